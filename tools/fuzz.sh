#!/bin/bash
# Fuzzes every reader for some minutes in all, from where the last run ended.
#   tools/fuzz.sh MINUTES [TARGET...]     default targets: all (tests/fuzz/CMakeLists.txt)
#   tools/fuzz.sh --runs N [TARGET...]    N files for each target instead
#   tools/fuzz.sh --coverage              lines of each reader that the corpora reach, in percent
# Builds the preset fuzz (clang, libFuzzer, address and undefined behaviour sanitizers; the readers
# alone). What was reached stays in build/fuzz/corpus; what breaks a reader goes to
# build/fuzz/findings: put it into tests/fuzz/regressions/TARGET with the mending of its cause. One
# line for each target: files that were read, edges of the code that they reach, memory of the
# process, and of the heap for a byte of a file at most. Exit code 1 if
# anything was found.
set -euo pipefail
cd "$(dirname "$0")/.."

case ${1:-} in
  --coverage) minutes= ;;
  --runs)
    [[ ${2:-} =~ ^[0-9]+$ ]] || {
      echo "fuzz.sh: error: --runs: expected a whole number; got '${2:-}'" >&2
      exit 2
    }
    minutes=0 runs=$2
    shift
    ;;
  '' | -h | --help)
    sed -n '2,11s/^# \{0,1\}//p' "$0"
    exit 0
    ;;
  *[!0-9.]*)
    echo "fuzz.sh: error: expected a number of minutes; got '$1'" >&2
    exit 2
    ;;
  *) minutes=$1 ;;
esac
shift
targets=("$@")
if ((${#targets[@]} == 0)); then
  mapfile -t targets < <(sed -n '/^set(SURFSEG_FUZZ_TARGETS/,/)/p' tests/fuzz/CMakeLists.txt |
    sed 's/set(SURFSEG_FUZZ_TARGETS//; s/)//' | xargs -n 1)
fi

cmake --preset fuzz >/dev/null
nice -n 15 cmake --build --preset fuzz -j1 >/dev/null
build=build/fuzz
export LSAN_OPTIONS=suppressions=tests/lsan.supp:print_suppressions=0
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
[[ -d /dev/shm ]] && export TMPDIR=${TMPDIR:-/dev/shm}

if [[ -z $minutes ]]; then
  for target in "${targets[@]}"; do
    mkdir -p "$build/corpus/$target"
    LLVM_PROFILE_FILE=$build/profile/$target.profraw \
      "$build/bin/fuzz_$target" -runs=0 "$build/corpus/$target" "tests/fuzz/corpus/$target" \
      >/dev/null 2>&1 || true
  done
  profdata=$(command -v llvm-profdata llvm-profdata-14 | head -1)
  cov=$(command -v llvm-cov llvm-cov-14 | head -1)
  "$profdata" merge -o "$build/profile/all" "$build"/profile/*.profraw
  "$cov" report "$build/bin/fuzz_${targets[0]}" -instr-profile "$build/profile/all" |
    grep -E '^lib(surf|curve).*(read_|byte_stream|raw_scalars|dicom_structure|slice_stack)
^lib(surf|curve).*(vdb_|_json|vtk_xml|space)' |
    awk '{printf "%-48s %s of %s lines\n", $1, $10, $8}'
  exit 0
fi

if [[ -n ${runs:-} ]]; then
  length=-runs=$runs
else
  seconds=$(awk "BEGIN {s = 60 * $minutes / ${#targets[@]}; print (s < 1 ? 1 : int(s))}")
  length=-max_total_time=$seconds
fi
found=0
for target in "${targets[@]}"; do
  mkdir -p "$build/corpus/$target" "$build/findings/$target"
  log=$build/findings/$target.log
  folders=("$build/corpus/$target" "tests/fuzz/corpus/$target")
  [[ -d tests/fuzz/regressions/$target ]] && folders+=("tests/fuzz/regressions/$target")
  options=("$length" -timeout=60 -rss_limit_mb=2048 -max_len=16384
    -artifact_prefix="$build/findings/$target/" -print_final_stats=1 -verbosity=1)
  [[ -f tests/fuzz/dictionaries/$target.dict ]] &&
    options+=(-dict="tests/fuzz/dictionaries/$target.dict")
  status=ok
  LLVM_PROFILE_FILE=/dev/null nice -n 15 "$build/bin/fuzz_$target" "${options[@]}" \
    "${folders[@]}" >"$log" 2>&1 || status=FOUND
  [[ $status == FOUND ]] && found=1
  awk -v target="$target" -v status="$status" '
    /number_of_executed_units/ {n = $2} /peak_rss_mb/ {rss = $2} /most_heap_per_byte/ {heap = $2}
    /cov:/ {for (i = 1; i < NF; i++) if ($i == "cov:") cov = $(i + 1)}
    END {
      printf "%-16s %-6s %10d runs  %6d edges  %5d MB  %6d per byte\n",
        target, status, n, cov, rss, heap
    }' "$log"
  [[ $status == FOUND ]] && grep -aE 'ERROR|runtime error|^[a-z0-9-]+: |Test unit written' "$log" |
    head -4 | sed 's/^/    /'
done
exit $found
