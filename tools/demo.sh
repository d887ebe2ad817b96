#!/bin/bash
# Sets the machine up, builds the programs and segments a real scan: the lateral ventricles in the
# T1 MRI of Colin 27 (ch2.nii.gz of Debian's mricron-data), from one seed point and nothing else.
# Writes mesh, label map, summary and pictures to build/demo/.
set -euo pipefail
cd "$(dirname "$0")/.."

if (($# > 0)); then
  sed -n '2,4s/^# \{0,1\}//p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 2
fi

tools/setup.sh --demo-data
cmake --preset release
cmake --build --preset release -j2 --target surfseg

surfseg=build/release/bin/surfseg
scan=/usr/share/mricron/templates/ch2.nii.gz
out=build/demo
mkdir -p "$out"
$surfseg info "$scan" | tee "$out/scan.txt"
$surfseg segment "$scan" --seed 10,-10,22 -o "$out/ventricles.stl" \
  --mask "$out/ventricles.nii.gz" --json "$out/ventricles.json"
$surfseg render "$out/ventricles.stl" --volume "$scan" -o "$out/slices.png"
xvfb-run -a $surfseg render "$out/ventricles.stl" -o "$out/ventricles.png"
mkdir -p "$out/studio"
cp "$scan" "$out/studio/scan.nii.gz"
ls -l "$out"
echo "demo.sh: see $(pwd)/$out"
echo "demo.sh: to click and mend by hand: $surfseg studio $out/studio/scan.nii.gz"
