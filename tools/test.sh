#!/bin/bash
# Sets the machine up, builds the release preset and runs the tests.
#   tools/test.sh         all tests but the slow ones
#   tools/test.sh --all   the slow ones too: hundreds of random evolutions, ten minutes more
# The last lines are those of ctest; the exit code is 0 only if every test passed.
set -euo pipefail
cd "$(dirname "$0")/.."

selection=(-LE '^slow$')
case ${1:-} in
  '') ;;
  --all) selection=() ;;
  -h | --help)
    sed -n '2,5s/^# \{0,1\}//p' "$0"
    exit 0
    ;;
  *)
    echo "test.sh: error: unknown option '$1'; see --help" >&2
    exit 2
    ;;
esac

tools/setup.sh
cmake --preset release
cmake --build --preset release -j2
ctest --preset release -j2 "${selection[@]}"
