#!/bin/bash
# Runs surfseg on scans with reference segmentations and writes docs/results.md:
#
#   tools/evaluate-real.sh DATA_DIR [OUTPUT.md]
#
# DATA_DIR holds seeds.json: {"entries": [{"volume", "structure", "mask", "calm_seed_ras_mm"}]} and
# the files it names. Each structure is run from its seed alone, then those with a preset in
# data/presets with it. A run is interrupted after SURFSEG_TIME_LIMIT seconds (120) and its last
# surface is judged.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
[ $# -ge 1 ] || { sed -n '2,9p' "$0" >&2; exit 2; }
data=$(cd "$1" && pwd)
output=${2:-$root/docs/results.md}
surfseg=${SURFSEG:-$root/build/release/bin/surfseg}
limit=${SURFSEG_TIME_LIMIT:-120}
for program in jq "$surfseg"; do
  command -v "$program" >/dev/null || { echo "evaluate-real.sh: $program is missing" >&2; exit 2; }
done
[ -f "$data/seeds.json" ] || { echo "evaluate-real.sh: $data/seeds.json is missing" >&2; exit 3; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# A row without numbers, with the first line of the last error; the others go on.
failed() {  # volume structure what
  echo "| $1 | $2 | - | - | - | - | - | - | - | $3: $(head -1 "$work/error" | cut -c1-120 | tr '|' '/') |"
}

# One run; prints a row of the table.
row() {  # volume structure mask seed [option...]
  local volume=$1 structure=$2 mask=$3 seed=$4 code=0
  shift 4
  rm -f "$work"/s.stl "$work"/s.json "$work"/e.json
  timeout --signal=INT --kill-after=60 "$limit" "$surfseg" segment "$data/$volume" "--seed=$seed" \
    -o "$work/s.stl" --json "$work/s.json" --quiet "$@" 2>"$work/error" || code=$?
  if [ ! -f "$work/s.stl" ]; then
    failed "$volume" "$structure" "exit $code"
    return
  fi
  "$surfseg" evaluate "$work/s.stl" --reference "$data/$mask" --json "$work/e.json" >/dev/null 2>"$work/error" || {
    failed "$volume" "$structure" "evaluate: exit $?"
    return
  }
  jq -rn --slurpfile s "$work/s.json" --slurpfile e "$work/e.json" --arg v "$volume" \
    --arg t "$structure" --arg c "$code" '
    def d($n): if . == null then "-" else . * pow(10; $n) | round / pow(10; $n) end;
    $s[0] as $s | $e[0] as $e |
    "| \($v) | \($t) | **\($e.dice | d(3))** | \($e.volume_difference_percent | d(1)) | \($e.distance.mean_mm | d(2)) | \($e.distance.p95_mm | d(2)) | \($s.triangles) | \($s.min_angle_deg | d(1)) | \($s.time_s | d(1)) | \(if $c == "0" then "" else "exit \($c): " end)\($s.outcome): \($s.stop_message) |"' \
    2>"$work/error" || failed "$volume" "$structure" "summary"
}

header() {
  echo "| volume | structure | Dice | volume % | mean mm | 95 % mm | triangles | min angle | time s | stop |"
  echo "|---|---|---|---|---|---|---|---|---|---|"
}

entries() {
  jq -r '.entries[] | select(.volume and .mask and .calm_seed_ras_mm) | [.volume, .structure, .mask, (.calm_seed_ras_mm | join(","))] | @tsv' \
    "$data/seeds.json"
}

preset_of() {  # volume structure
  case "$1/$2" in
    ct_abdomen*/kidney_right) echo kidney-ct ;;
    ct_abdomen*/urinary_bladder) echo bladder-ct ;;
    mri_t1_colin27*/brain) echo brain-t1 ;;
    mri_t1_sarcoma*/tumour_gtv) echo sarcoma-t1 ;;
    mri_flair*/whole_tumour) echo tumour-flair ;;
    mri_t2_spine*/spinal_cord) echo spinal-cord-t2 ;;
  esac
}

{
  echo "# Results on real scans"
  echo
  echo "Made by \`tools/evaluate-real.sh\` (surfseg $("$surfseg" --version | cut -d' ' -f2), $(nproc) cores;"
  echo "times on a shared machine, reading included). Dice at voxel centres against the reference mask; distances"
  echo "symmetric, between the surface and the mask's boundary. The scans and references are not part of the project."
  echo
  echo "## The seed alone, no options"
  echo
  header
  while IFS=$'\t' read -r volume structure mask seed; do
    row "$volume" "$structure" "$mask" "$seed" </dev/null
  done < <(entries)
  echo
  echo "## With a preset of data/presets"
  echo
  header
  while IFS=$'\t' read -r volume structure mask seed; do
    preset=$(preset_of "$volume" "$structure")
    [ -z "$preset" ] || row "$volume" "$structure ($preset)" "$mask" "$seed" \
      --preset "$preset" </dev/null
  done < <(entries)
} >"$work/results.md"
mv "$work/results.md" "$output"
echo "wrote $output"
