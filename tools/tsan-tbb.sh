#!/bin/bash
# Builds Debian's TBB from its source package with the thread sanitizer, into build/tsan-tbb/lib,
# from where the tests of the preset tsan load it. Debian's own hides from the sanitizer how it
# hands work from thread to thread: every loop in parallel would be reported as a race.
#
#   tools/tsan-tbb.sh    nothing to do where it is there for the version that is installed
set -euo pipefail
cd "$(dirname "$0")/.."

version=$(dpkg-query -W -f '${source:Version}' libtbb12)
folder=$PWD/build/tsan-tbb
[[ $(cat "$folder/version" 2>/dev/null) == "$version" ]] && exit
rm -rf "$folder"
mkdir -p "$folder/lists/partial" "$folder/sources"

# The sources of the packages that the system takes from Debian.
for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
  [[ -f $file ]] || continue
  sed -E 's/^deb /deb-src /; s/^Types:.*/Types: deb-src/' "$file" >"$folder/sources/${file##*/}"
done
apt=(apt-get -q -o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$folder/sources"
  -o "Dir::State::lists=$folder/lists" -o APT::Sandbox::User=root)
"${apt[@]}" update >"$folder/log" 2>&1 || true # other servers than Debian's may have no sources
(cd "$folder" && "${apt[@]}" source "onetbb=$version" >>log 2>&1) || {
  echo "tsan-tbb.sh: error: no source package onetbb $version; see $folder/log" >&2
  exit 1
}

cmake -S "$folder"/*tbb-*/ -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_COMPILER=clang++ -DTBB_SANITIZE=thread -DTBB_TEST=OFF -DTBBMALLOC_BUILD=OFF \
  -DTBB_STRICT=OFF -DTBB_OUTPUT_DIR_BASE=lib >>"$folder/log"
cmake --build "$folder/build" --target tbb >>"$folder/log"
ln -s build/lib_release "$folder/lib"
echo "$version" >"$folder/version"
