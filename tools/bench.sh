#!/bin/bash
# Time, memory and error of surfseg on phantoms, with other programs beside it in the same run:
#
#   tools/bench.sh             64 to 256, three runs each; the table goes to docs/performance.md
#   tools/bench.sh --help      sizes, runs, limits, output
#
# Needs Debian's python3-numpy; peers are built and run where they are installed (libinsighttoolkit5-dev,
# libcgal-dev, python3-vtk9, python3-skimage), and named as skipped where they are not.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
python=${SURFSEG_PYTHON:-/usr/bin/python3}
peers=${SURFSEG_PEERS:-$root/build/peers}
if [ ! -x "${SURFSEG:-$root/build/release/bin/surfseg}" ]; then
  echo "bench.sh: build/release/bin/surfseg is missing: cmake --preset release && ninja -C build/release" >&2
  exit 2
fi
case " $* " in
  *" --light "*|*" --help "*|*" -h "*) ;;
  *) if ! { cmake -S "$root/tests/bench/peers" -B "$peers" >/dev/null && cmake --build "$peers" --parallel 2 >/dev/null; }; then
       echo "bench.sh: the peers' drivers cannot be built (cmake -S tests/bench/peers -B build/peers): skipped" >&2
     fi ;;
esac
exec "$python" "$root/tools/bench.py" --surfseg "${SURFSEG:-$root/build/release/bin/surfseg}" --peers "$peers" "$@"
