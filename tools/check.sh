#!/bin/bash
# Looks for what tests alone do not show, one line for each part:
#   asan   the tests with the address and undefined behaviour sanitizers (preset asan)
#   tsan   the tests with the thread sanitizer (preset tsan), and TBB, too (tools/tsan-tbb.sh)
#   tidy   clang-tidy on all sources (preset tidy)
#   fuzz   the corpora of tests/fuzz and what tools/fuzz.sh has gathered (preset fuzz)
#
#   tools/check.sh [--programs NAME,...] [--again] [PART...]   default: all four
#
# --programs: only these test programs in asan and tsan, such as surf_base_tests,surf_flow_tests.
# A run that was ended goes on: what passed is remembered in build/check until code, a test or a page
# changes, or --again. All cores are used, at a low priority. Exit code 1 if anything was found, or
# a part could not be looked at; what, is in build/check/PART.log, and in build/tsan/report.PID for
# each process that tsan found something in, whoever started it: a program that a test ends may have
# told nobody else.
set -euo pipefail
cd "$(dirname "$0")/.."

parts=() programs='' again=''
while (($#)); do
  case $1 in
    --programs)
      programs=${2:?check.sh: error: --programs: expected names}
      shift
      ;;
    --again) again=yes ;;
    asan | tsan | tidy | fuzz) parts+=("$1") ;;
    -h | --help)
      sed -n '2,15s/^# \{0,1\}//p' "$0"
      exit 0
      ;;
    *)
      echo "check.sh: error: unknown argument '$1'; see --help" >&2
      exit 2
      ;;
  esac
  shift
done
((${#parts[@]})) || parts=(asan tsan tidy fuzz)

state=build/check
mkdir -p "$state"
code=(libsurf libcurve tools tests cmake packaging data docs README.md CMakeLists.txt CMakePresets.json)
# Files that git does not know yet, too; what has gone is an error of sha1sum, which counts as well.
version=$(git ls-files -coz --exclude-standard -- "${code[@]}" | { xargs -0r sha1sum 2>&1 || true; } |
  sha1sum | cut -c1-40)
if [[ -n $again || $(cat "$state/version" 2>/dev/null) != "$version" ]]; then
  rm -f "$state"/*.passed "$state"/*.log build/tsan/report.*
  echo "$version" >"$state/version"
fi
found=0

# report PART WHAT PASSED FAILED
report() {
  printf '%-5s %6d %s passed, %d failed%s\n' "$1" "$3" "$2" "$4" \
    "$( (($4)) && echo "; see $state/$1.log" || true)"
  (($4 == 0)) || found=1
}

# Numbers and names of the tests of a preset as tools/test.sh chooses them, without the slow ones
# (200 kills, a browser's memory, fuzz) and those of programs that are not built. Fails where ctest
# does, and where there are none.
tests_of() {
  local listed
  listed=$(ctest --preset "$1" -N -LE '^slow$') || return
  sed -n 's/^ *Test *#\([0-9]*\): \(.*\)$/\1 \2/p' <<<"$listed" | grep -v '_NOT_BUILT'
}

sanitize() {
  local preset=$1 targets=all passed=$state/$1.passed log=$state/$1.log
  [[ -z $programs ]] || targets=${programs//,/ }
  cmake --preset "$preset" >/dev/null
  [[ $preset != tsan ]] || tools/tsan-tbb.sh
  # shellcheck disable=SC2086
  nice -n 15 cmake --build --preset "$preset" -j "$(nproc)" --target $targets >"$log.build" 2>&1 || {
    echo "$preset: the build failed; see $log.build"
    found=1
    return
  }
  touch "$passed"
  local numbers=() number name tests failed reports status=0
  tests=$(tests_of "$preset" 2>"$log") || {
    echo "$preset: ctest lists no tests; see $log"
    found=1
    return
  }
  while read -r number name; do
    grep -qxF "$name" "$passed" || numbers+=("$number")
  done <<<"$tests"
  : >"$log"
  if ((${#numbers[@]})); then
    nice -n 15 ctest --preset "$preset" -j "$(nproc)" \
      -I "0,0,0,$(IFS=,; echo "${numbers[*]}")" 2>&1 | tee "$log" |
      sed -unE 's/^ *[0-9]+\/[0-9]+ Test +#[0-9]+: (.*[^ .]) \.+ *(Passed|\*\*\*Skipped).*/\1/p' \
        >>"$passed" || status=${PIPESTATUS[0]}
  fi
  failed=$(grep -E '^ *[0-9]+/[0-9]+ Test' "$log" | grep -cvE 'Passed|\*\*\*Skipped' || true)
  report "$preset" tests "$(wc -l <"$passed")" "$failed"
  ((status == 0 || failed)) || {
    echo "$preset: ctest ended with exit code $status; see $log"
    found=1
  }
  reports=$(find "build/$preset" -maxdepth 1 -name 'report.*' | wc -l)
  ((reports == 0)) || {
    echo "$preset: $reports processes with reports; see build/$preset/report.*"
    found=1
  }
}

tidy() {
  local passed=$state/tidy.passed log=$state/tidy.log sources
  cmake --preset tidy >/dev/null
  touch "$passed"
  : >"$log"
  sources=$(git ls-files -co --exclude-standard 'libsurf/*.cpp' 'libcurve/*.cpp' 'tools/*.cpp' |
    grep -vxFf "$passed" || true)
  # shellcheck disable=SC2016 # the arguments are those of the shell that xargs starts
  [[ -z $sources ]] || xargs -d '\n' -n 1 -P "$(nproc)" nice -n 15 bash -c '
    if said=$(clang-tidy --quiet -p build/tidy "$2" 2>/dev/null); then echo "$2" >>"$0"
    else printf "%s\n" "$said" >>"$1"; fi' "$passed" "$log" <<<"$sources"
  report tidy files "$(wc -l <"$passed")" "$(grep -vxFf "$passed" <<<"$sources" | grep -c . || true)"
}

fuzz() {
  local log=$state/fuzz.log n=0 failed=0 target folders
  cmake --preset fuzz >/dev/null
  nice -n 15 cmake --build --preset fuzz -j "$(nproc)" >"$log.build" 2>&1 || {
    echo "fuzz: the build failed; see $log.build"
    found=1
    return
  }
  export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0 LLVM_PROFILE_FILE=/dev/null
  for program in build/fuzz/bin/fuzz_*; do
    target=${program##*/fuzz_}
    folders=()
    for folder in "tests/fuzz/corpus/$target" "tests/fuzz/regressions/$target" \
      "build/fuzz/corpus/$target"; do
      [[ -d $folder ]] && folders+=("$folder")
    done
    n=$((n + $(find "${folders[@]}" -type f | wc -l)))
    nice -n 15 "$program" -runs=0 -timeout=10 -artifact_prefix="$state/" "${folders[@]}" \
      >>"$log" 2>&1 || failed=$((failed + 1))
  done
  report fuzz files "$n" "$failed"
}

for part in "${parts[@]}"; do
  case $part in
    tidy) tidy ;;
    fuzz) fuzz ;;
    *) sanitize "$part" ;;
  esac
done
exit $found
