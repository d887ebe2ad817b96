#!/bin/bash
# Installs what surfseg needs to be built and tested on Debian 12. Asks for nothing and
# changes nothing when all is there already.
#   tools/setup.sh               compiler, libraries, test tools
#   tools/setup.sh --demo-data   the scans of tools/demo.sh as well
#   tools/setup.sh --docs        Doxygen, for the API reference
#   tools/setup.sh --cluster     Slurm and Snakemake, for the tests of tools/cohort
#   tools/setup.sh --package     lintian, mmdebstrap and zsh, for all that is tested of the Debian package
#   tools/setup.sh --fuzz        clang and its sanitizers, for tools/fuzz.sh and tools/check.sh
# docs/developer.md says what each package is for.
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache pkg-config
  libeigen3-dev libopenmesh-dev libcgal-dev libceres-dev libsuitesparse-dev libopenblas-pthread-dev
  libopenvdb-dev libtbb-dev libboost-iostreams-dev libblosc-dev
  libvtk9-dev libopenmpi-dev libx11-dev
  libmaxflow-dev
  libgdcm-dev libteem-dev libnifti2-dev zlib1g-dev libpng-dev libjpeg62-turbo-dev libtiff-dev libssl-dev
  libcli11-dev nlohmann-json3-dev libfmt-dev
  libgtest-dev libbenchmark-dev
  python3-numpy python3-scipy python3-nibabel
  python3-dev pybind11-dev python3-pytest
  libdcmtk-dev dicom3tools python3-pydicom python3-meshio python3-vtk9 lib3mf1
  libcpp-httplib-dev chromium libxml2-utils
  xvfb xauth libgl1-mesa-dri help2man
  dpkg-dev file jq
)

fail() {
  echo "setup.sh: error: $1" >&2
  exit 1
}

for argument in "$@"; do
  case $argument in
    --demo-data) packages+=(mricron-data) ;;
    --docs) packages+=(doxygen) ;;
    --package) packages+=(lintian mmdebstrap zsh) ;;
    --fuzz) packages+=(clang clang-tidy dpkg-dev llvm libclang-rt-14-dev) ;;
    --cluster) packages+=(slurm-wlm slurm-wlm-basic-plugins munge snakemake) ;;
    -h | --help)
      sed -n '2,10s/^# \{0,1\}//p' "$0"
      exit 0
      ;;
    *)
      echo "setup.sh: error: unknown option '$argument'; see --help" >&2
      exit 2
      ;;
  esac
done

# Node.js may be there from elsewhere, with an npm that Debian's would conflict with.
{ command -v node && command -v npm; } >/dev/null || packages+=(nodejs npm)

command -v dpkg-query >/dev/null ||
  fail "this is not a Debian system (no dpkg); install by hand what matches: ${packages[*]}"
missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
  [[ $status == 'install ok installed' ]] || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  echo "setup.sh: all ${#packages[@]} packages are there"
  exit 0
fi

system='an unknown system'
if [[ -r /etc/os-release ]]; then
  # shellcheck source=/dev/null
  system=$(. /etc/os-release && echo "${ID:-unknown} ${VERSION_ID:-}")
fi
[[ $system == 'debian 12' ]] ||
  echo "setup.sh: warning: made for Debian 12, this is $system; packages may differ" >&2
command -v apt-get >/dev/null || fail "apt-get is missing; install by hand: ${missing[*]}"

as_root=(env DEBIAN_FRONTEND=noninteractive)
if ((EUID != 0)); then
  command -v sudo >/dev/null ||
    fail "sudo is missing; as root run: apt-get install --no-install-recommends ${missing[*]}"
  as_root=(sudo "${as_root[@]}")
fi
echo "setup.sh: installing ${missing[*]}"
"${as_root[@]}" apt-get update </dev/null
"${as_root[@]}" apt-get install -y --no-install-recommends "${missing[@]}" </dev/null
