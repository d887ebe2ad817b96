#!/bin/bash
# Runs the studies of the Mumford-Shah model on two images and writes docs/mumford-shah-images.md
# with its pictures in docs/pictures:
#
#   tools/mumford-shah-images.sh DATA_DIR
#
# DATA_DIR holds img2d_cmr_hf09.png, img2d_mr_sarcoma_sts002.png and their masks (IMAGE__STRUCTURE.png).
# An image that is not there is skipped, and the page says so. The program of the studies,
# mumford_shah_study, is built first.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
[ $# -eq 1 ] || { sed -n '2,9p' "$0" >&2; exit 2; }
data=$(cd "$1" && pwd)
output=$root/docs/mumford-shah-images.md
[ -n "${MUMFORD_SHAH_STUDY:-}" ] || cmake --build "$root/build/release" --target mumford_shah_study >&2
program=${MUMFORD_SHAH_STUDY:-$root/build/release/bin/mumford_shah_study}
command -v "$program" >/dev/null ||
  { echo "mumford-shah-images.sh: $program is missing; build the target mumford_shah_study" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# One study: what it shows, its table, its picture.
study() {  # name study text option...
  local name=$1 study=$2 text=$3
  shift 3
  echo
  echo "$text"
  "$program" "$study" --name "$name" --pictures "$root/docs/pictures" "$@"
  echo
  echo "![$name, $study](pictures/mumford-shah-$name-$study.png)"
}

# The studies of an image.
section() {  # title file structure name credit option...
  local title=$1 file=$2 structure=$3 name=$4 credit=$5 image=$data/$2 mask=$data/${2%.png}__$3.png
  shift 5
  echo
  echo "## $title"
  echo
  if [ ! -f "$image" ] || [ ! -f "$mask" ]; then
    echo "skipped: $file or its mask of $structure is not there"
    echo "mumford-shah-images.sh: skipped $file: it or its mask of $structure is not in $data" >&2
    return
  fi
  echo "$credit"
  echo
  echo "Options: \`$*\`"
  local options=(--image "$image" --reference "$mask" "$@")
  study "$name" flows "**L2 against H1**, without the coarse stages; explicit L2, semi-implicit L2 and H1 from left to right." "${options[@]}"
  study "$name" noise "**Noise** of 0.1, 0.25 and 0.5 of the contrast is added: the image above, u below. The PSNR is that against the image as it was." "${options[@]}"
  study "$name" mu "**mu**: u for growing mu." "${options[@]}"
  study "$name" gamma "**gamma**: u for growing gamma." "${options[@]}"
  study "$name" start "**Start**, in the order of the table." "${options[@]}"
}

left_ventricle() {
  section "A left ventricle" img2d_cmr_hf09.png left_ventricle_cavity left-ventricle \
    "Cine MRI of the heart, short axis, 256 x 256 pixels; the reference is an expert's contour of the cavity, muscles inside it included. Image: Sunnybrook Cardiac Data (CC0), by way of mshunshin/SegNetCMR." \
    --circle 137,131,30 --mu 25 --gamma 0.15 --panel 256 \
    --start outside=137,131,45 --start inside=137,131,15 --start overlapping=120,120,25
}

sarcoma() {
  section "A sarcoma" img2d_mr_sarcoma_sts002.png tumour sarcoma \
    "T1 MRI, 115 x 90 pixels; the reference is an expert's contour of the tumour, drawn on T2. Image: collection Soft-tissue-Sarcoma of The Cancer Imaging Archive, patient STS_002, by way of oncoray/mirp, [CC BY 3.0](https://creativecommons.org/licenses/by/3.0/); one slice in the window 0..900, here with curves, noise and u. Archive: Clark et al., J Digit Imaging 26(6), 2013." \
    --circle 56,40,19 --mu 25 --gamma 0.15 --panel 230 \
    --start outside=52,40,33 --start inside=56,40,12 --start overlapping=66,46,18
}

left_ventricle >"$work/left-ventricle.md" &
first=$!
sarcoma >"$work/sarcoma.md"
wait "$first"
{
  echo "# The Mumford-Shah model on two images"
  echo
  echo "Made by \`tools/mumford-shah-images.sh\`; what it means is said on [the model's page](mumford-shah.md). Lengths are in pixels, mu in"
  echo "pixel^2. Blue: the start. Orange: the end. Dice counts pixels; distances are those to the staircase of the reference's pixels, from"
  echo "which a smooth contour is up to a quarter of a pixel away. Seconds are wall time on a shared machine."
  cat "$work/left-ventricle.md" "$work/sarcoma.md"
} >"$work/page.md"
mv "$work/page.md" "$output"
echo "wrote $output"
