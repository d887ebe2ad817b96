#!/bin/bash
# Runs the study of thesis 5.1.2 on a phantom, images and slices and writes docs/real-images.md with
# its pictures in docs/pictures:
#
#   tools/real-images.sh DATA_DIR
#
# DATA_DIR holds img2d_mr_sarcoma_sts002.png, img2d_cmr_hf09.png, mri_t1_braincrop_snap.nii.gz,
# ct_vertebra_tpt.nii.gz and their masks (IMAGE__STRUCTURE). What is not there is skipped, and the
# page says so. The program of the study, real_images_study, is built first.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
[ $# -eq 1 ] || { sed -n '2,9p' "$0" >&2; exit 2; }
data=$(cd "$1" && pwd)
output=$root/docs/real-images.md
[ -n "${REAL_IMAGES_STUDY:-}" ] || cmake --build "$root/build/release" --target real_images_study >&2
program=${REAL_IMAGES_STUDY:-$root/build/release/bin/real_images_study}
command -v "$program" >/dev/null ||
  { echo "real-images.sh: $program is missing; build the target real_images_study" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The study with its tables and pictures.
study() {  # name starts option...
  local name=$1 starts=$2 start
  shift 2
  "$program" --pictures "$root/docs/pictures" "$@"
  echo
  echo "![$name: image, smoothed, H](pictures/real-images-$name-fields.png)"
  for start in $starts; do
    echo
    echo "![$name from $start](pictures/real-images-$name-$start.png)"
  done
}

# An image: what it shows, its options, the study, what it says.
section() {  # title file structure name starts credit verdict option...
  local title=$1 file=$2 structure=$3 name=$4 starts=$5 credit=$6 verdict=$7
  shift 7
  local stem=${file%%.*}
  local image=$data/$file mask=$data/${stem}__$structure.${file#*.}
  echo
  echo "## $title"
  echo
  if [ ! -f "$image" ] || [ ! -f "$mask" ]; then
    echo "skipped: $file or its mask of $structure is not there"
    echo "real-images.sh: skipped $file: it or its mask of $structure is not in $data" >&2
    return
  fi
  echo "$credit"
  echo
  echo "Options: \`$*\`"
  study "$name" "$starts" --name "$name" --image "$image" --reference "$mask" "$@"
  echo
  echo "$verdict"
}

sarcoma() {
  section "A sarcoma" img2d_mr_sarcoma_sts002.png tumour sarcoma "one three" \
    "T1 MRI, 115 x 90 pixels; the reference is an expert's contour of the tumour, drawn on T2. Image: collection Soft-tissue-Sarcoma of The Cancer Imaging Archive, patient STS_002, by way of oncoray/mirp, [CC BY 3.0](https://creativecommons.org/licenses/by/3.0/); one slice in the window 0..900, here smoothed, with curves and with H. Archive: Clark et al., J Digit Imaging 26(6), 2013." \
    "**What it shows.** H1 takes half as many steps as L2 from one seed and ends at the same J. Three seeds take more steps than one: they are smaller, slowed by their curvature, and the tumour is convex, so that one seed has no way round anything. Selective smoothing changes little, since the image is smooth where the curves pass." \
    --selective-sigma 4 --selective-threshold 0.078 --sigma 1.5 --gamma0 0.06 --gamma=-1 --lambda 0.25 \
    --tol-l2 1e-4 --tol-h1 1e-4 --start one=56,40,8 --start three=40,38,5+58,42,5+70,38,5
}

left_ventricle() {
  section "A left ventricle" img2d_cmr_hf09.png left_ventricle_cavity left-ventricle "one three" \
    "Cine MRI of the heart, short axis, 140 x 140 pixels round it; the reference is an expert's contour of the cavity, muscles inside it included. Image: Sunnybrook Cardiac Data (CC0), by way of mshunshin/SegNetCMR." \
    "**What it shows.** Without selective smoothing the blood's texture costs up to two and a half times the steps. Three seeds save hardly any: the cavity is nearly convex. The curves leave out the muscles in the cavity, which the expert counted in: hence a Dice below 0.9 by either flow." \
    --crop 60,60,140,140 --window 0,90 --selective-sigma 7 --selective-threshold 0.196 --sigma 2.5 --gamma0 0.055 --gamma=-1 --lambda 0.5 \
    --tol-l2 1e-4 --tol-h1 1e-4 --start one=77,71,10 --start three=75,52,8+65,80,8+88,80,8
}

ventricles() {
  section "Two lateral ventricles: curves that split" mri_t1_braincrop_snap.nii.gz lateral_ventricles ventricles "around" \
    "T1 MRI of the brain, axial slice of 78 x 110 pixels; the reference is the segmentation that comes with the image. Image: tutorial of ITK-SNAP (pyushkevich/itksnap, Testing/TestData/MRIcrop-orig.gipl.gz, GPL-3), here smoothed, with curves and with H." \
    "**What it shows.** Two circles that overlap become one curve round both ventricles, which splits, by either flow, with and without selective smoothing. H1 saves no steps here, nor did it with the tiger of the thesis." \
    --slice 53 --window 0,90 --selective-sigma 4 --selective-threshold 0.078 --sigma 1 --gamma0 0.05 --gamma=1 --lambda 1 \
    --tol-l2 1e-4 --tol-h1 1e-5 --start around=31,36,29+46,36,29
}

vertebra_credit="CT, axial slice of 73 x 73 pixels of 1.5 mm; the reference is the label map that comes with the scan. Scan: sample of TPTBox (Hendrik-code/TPTBox, TPTBox/tests/sample_ct, Apache-2.0), here a slice, smoothed, with curves and with H."

vertebra() {
  section "A vertebra" ct_vertebra_tpt.nii.gz vertebra vertebra "one three" "$vertebra_credit" \
    "**What it shows: the boundary is not captured completely**, unlike in the thesis. The wall of compact bone is one pixel thick here, and marrow and muscle are equally dark, so H is small on both sides of the wall and the curve rests at one of them. The transverse processes are 3 pixels wide, thinner than the smallest circle that gamma_0 lets grow (radius gamma_0 = 2 pixels), and are not entered. With selective smoothing the thin wall before the canal is lost and the canal is filled; without it the wall stays, and the region in the body with it. Seeds in the laminae add what one seed in the body never reaches. H1 takes half as many steps as L2." \
    --slice 20 --window=-200,800 --selective-sigma 4 --selective-threshold 0.196 --sigma 1 --gamma0 0.06 --gamma=-1 --lambda 0.5 \
    --tol-l2 1e-4 --tol-h1 1e-4 --start one=36,20,5 --start three=36,20,5+28,38,2.5+45,38,2.5
  section "The same vertebra from outside" ct_vertebra_tpt.nii.gz vertebra vertebra-outside "outside" "As above." \
    "**What it shows.** From outside the curve comes to the body's outer wall and into the concavities between the processes, then draws back from these as they are thinner than what gamma_0 lets stand. The canal is filled: no curve can get there. Without selective smoothing the curve stays at the edge between muscle and fat on the right." \
    --slice 20 --window=-200,800 --selective-sigma 4 --selective-threshold 0.196 --sigma 1 --gamma0 0.06 --gamma=1 --lambda 0.5 \
    --tol-l2 1e-4 --tol-h1 1e-4 --start outside=36,32,35
}

phantom() {
  echo
  echo "## A phantom"
  echo
  echo "A vertebra of 192 x 192 pixels, contrast 0.5, noise 0.06, waves of 8 pixels and amplitude 0.06 (\`real_images_study\` without options); selective sigma 4"
  echo "pixels, threshold 50/255, sigma 1.5 pixels, gamma_0 = 0.03, gamma = -1, lambda = 0.5, tolerances 1e-4."
  study phantom "one three"
  echo
  echo "**What it shows.** One seed and three find all of it, three in fewer steps. Without selective smoothing the waves hold the curves up, and they stay there: this"
  echo "is what the filter is for. H1 takes some more steps than L2: both are held by the bound on a step, which is what the image's edges allow."
}

{
  cat <<'TEXT'
# The minimal surface model on images

Thesis 5.1.2, made by `tools/real-images.sh`. The images of the thesis (bacteria, a tiger, a vertebra) are not at hand; these are others of the same kinds:
an object with seeds inside, several objects in one curve, a vertebra. The shortest side of an image is mapped to [-1, 1] and its intensities to [0, 1]; the
image goes through a selective Gaussian blur and a Gaussian blur, and curves descend (5.1), by the semi-implicit L2 flow and the explicit H1 flow, until |dJ| is
below a tolerance. Regions, Dice and mean distance are those with the reference, whose outline is the staircase of its pixels (the phantom's is exact).
Seconds are wall time on a shared machine.

Pictures: image, smoothed image and H, above with selective smoothing and below without. Then the curves, a row each for L2 and H1 with selective smoothing and
L2 and H1 without, at the start, when a quarter, half, three quarters and 95 % of what J falls by are done, and at the end, there with the reference in blue.

| | thesis | here | why |
|---|---|---|---|
| selective blur | radius 20 and 30 pixels | radius 8 and 14 (2 sigma) | smaller images: 73 to 192 pixels |
| its threshold | 20/255, 50/255 | the same | |
| Gaussian blur | radius 5 and 10 | sigma 1 to 2.5 pixels | smaller images |
| gamma_0 | 0.003 to 0.01 | 0.03 to 0.06 | below |
| gamma | 1, -1 | the same | |
| lambda | 0.5, 1 | 0.25 to 1 | the sarcoma's edge towards the muscle is faint |
| tolerances | 1e-2 to 1e-6 | 1e-4, once 1e-5 | |
| floor of H1's beta | 100 | 10 gamma_0 / r^2, r the shape's own radius | with 100 gamma_0 / r^2 a seed moves by a tenth of a pixel a step |
| derivatives | Scharr | Scharr | |
| between pixels | linear | cubic splines | H1 needs second derivatives |

No node goes further than 2 sigma (at least 2 pixels) in a step, nor past the first edge on its way.

**gamma_0.** Beside an edge that is blurred by sigma, ln H rises by 2 s / sigma^2 per length at the distance s. There (5.1) holds a curve that gamma drives where
gamma_0 times this outweighs |gamma|: it rests s = |gamma| sigma^2 / (2 gamma_0) beyond the edge. With the thesis' 0.003 that is five pixels in the phantom,
where the edge has ended: there is no minimum. So it was: L2 came below its tolerance while it crept across the edge (Dice 0.984), H1, with a floor of 100, went on and
filled the image (J = -2.85, where the vertebra has -0.61). gamma_0 is taken ten times larger, for s of a third of a pixel to a pixel; curves then rest that far beyond the edge, and
what bends more than 1 / gamma_0 is not followed.
TEXT
  phantom
  sarcoma
  left_ventricle
  ventricles
  vertebra
} >"$work/page.md"
mv "$work/page.md" "$output"
echo "wrote $output"
