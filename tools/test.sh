#!/bin/bash
# Sets the machine up, builds the release preset and runs the tests.
#   tools/test.sh         all tests but the slow ones
#   tools/test.sh --all   the slow ones too: hundreds of random evolutions, ten minutes more
# The last lines are those of ctest, then what each test that failed has said, once more; the exit
# code is 0 only if every test passed.
set -euo pipefail
cd "$(dirname "$0")/.."

selection=(-LE '^slow$')
case ${1:-} in
  '') ;;
  --all) selection=() ;;
  -h | --help)
    sed -n '2,6s/^# \{0,1\}//p' "$0"
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
status=0
ctest --preset release -j2 "${selection[@]}" || status=$?
if ((status)); then
  awk '/^[0-9]+\/[0-9]+ Testing: / { text = "" }
    { text = text $0 "\n" }
    /^Test (Failed|Timeout)/ { printf "%s\n", substr(text, length(text) > 4000 ? length(text) - 4000 : 1) }' \
    build/release/Testing/Temporary/LastTest.log
fi
exit "$status"
