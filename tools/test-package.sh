#!/bin/bash
# Makes the Debian package and installs it in a new Debian 12 system of its own, where nothing of
# ours is; then runs the programs there on a phantom. Needs mmdebstrap, root, a mirror of Debian and
# 2 GB below TMPDIR.
#   tools/test-package.sh [BUILD]          BUILD: build/release
set -euo pipefail
build=$(cd "${1:-build/release}" && pwd)
fail() { echo "test-package.sh: error: $1" >&2; exit 1; }
for tool in cpack mmdebstrap; do
  command -v $tool > /dev/null || fail "$tool is missing (apt-get install $tool)"
done
[ "$(id -u)" = 0 ] || fail "a system of its own is made by root only; run it by sudo"

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
(cd "$build" && cpack -G DEB -B "$scratch" > "$scratch/cpack.log" 2>&1) ||
  { cat "$scratch/cpack.log"; fail "cpack failed"; }
rm -rf "$scratch/_CPack_Packages"
deb=$(ls "$scratch"/surfseg_*.deb)
echo "$(basename "$deb"): $(stat -c %s "$deb") bytes," \
  "$(dpkg-deb -f "$deb" Depends | tr ',' '\n' | wc -l) dependencies"

root=$scratch/root
mmdebstrap --variant=apt --quiet bookworm "$root"
cp "$deb" "$root/surfseg.deb"
cp /etc/resolv.conf "$root/etc/resolv.conf" 2> /dev/null || true
chroot "$root" apt-get -qq update
DEBIAN_FRONTEND=noninteractive chroot "$root" apt-get -qq -y --no-install-recommends install \
  /surfseg.deb > "$scratch/apt.log" 2>&1 || { tail -20 "$scratch/apt.log"; fail "apt failed"; }
chroot "$root" surfseg --version
chroot "$root" surfseg phantom torus --size 48 --spacing 1 --noise 0.05 -o /torus.nii.gz
chroot "$root" surfseg segment /torus.nii.gz --seed 12,0,0 -o /torus.stl
chroot "$root" python3 -c '
import surfseg
print(surfseg.segment("/torus.nii.gz", [(12, 0, 0)]))'
chroot "$root" curveseg --version
echo "installed size: $(du -sm "$root/usr" | cut -f1) MB of the whole system"
