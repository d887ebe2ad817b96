#!/bin/bash
# package_test.sh BUILD SCRATCH VERSION: makes the Debian package, reads what it says, and runs the
# programs and the Python module from where it was unpacked.
set -euo pipefail
build=$1 scratch=$2 version=$3
for tool in cpack dpkg-deb dpkg-shlibdeps file; do
  command -v $tool > /dev/null || { echo "skipped: $tool is missing"; exit 77; }
done
fail() { echo "$1"; exit 1; }

rm -rf "$scratch"
mkdir -p "$scratch"
(umask 077 && cd "$build" && cpack -G DEB -B "$scratch" > "$scratch/cpack.log" 2>&1) ||
  { cat "$scratch/cpack.log"; exit 1; }
deb=$(ls "$scratch"/surfseg_"$version"_*.deb)

depends=$(dpkg-deb -f "$deb" Depends)
for library in libtbb libopenvdb libvtk9 libopenmesh libcholmod libgdcm libdcmtk libjpeg; do
  [[ $depends == *$library* ]] || fail "Depends lacks $library: $depends"
done
echo "$(stat -c %s "$deb") bytes, $(echo "$depends" | tr ',' '\n' | wc -l) dependencies"

files=$(dpkg-deb -c "$deb" | awk '{ print $6 }')
for file in bin/surfseg bin/curveseg bin/surfseg-slicer share/man/man1/surfseg-segment.1.gz \
    share/applications/surfseg-studio.desktop share/mime/packages/surfseg.xml share/bash-completion/completions/surfseg \
    share/doc/surfseg/copyright include/surfseg/libsurf/segment/segmentation.h \
    lib/cmake/surfseg/surfsegConfig.cmake; do
  grep -qx "./usr/$file" <<< "$files" || fail "the package lacks /usr/$file"
done

hidden=$(dpkg-deb -c "$deb" | awk '$1 !~ /^(l|-r..r..r|dr.xr.xr.x)/')
[ -z "$hidden" ] || fail "not for everybody: $hidden"

root=$scratch/root
dpkg-deb -x "$deb" "$root"
if find "$root/usr" -type f \( -path '*/bin/*' -o -name '*.so*' \) -exec readelf -d {} + | grep -E 'R(UN)?PATH'; then
  fail "a file has a search path of its own"
fi
man=$root/usr/share/man/man1
for page in "$man"/*; do
  n_named=$(zcat "$page" | sed -n '/^\.SH "SEE ALSO"/,$p' | grep -c '^\.BR ' || true)
  [ "$n_named" = $(($(find "$man" -type f | wc -l) - 1)) ] || fail "$page: SEE ALSO names $n_named pages"
done
# The loader's path stands for /usr/lib, which a real installation has.
export LD_LIBRARY_PATH=$root/usr/lib
[ "$("$root/usr/bin/surfseg" --version)" = "surfseg $version" ] || fail "another version"
"$root/usr/bin/surfseg" segment --preset list | grep -q kidney-ct || fail "no presets"
cd "$scratch"
"$root/usr/bin/surfseg" phantom ball --size 32 --spacing 1 -o ball.nii.gz > /dev/null
"$root/usr/bin/surfseg" segment ball.nii.gz --seed 0,0,0 -o ball.vtp > said.txt 2>&1
grep -q "closed, manifold, no self-intersections" said.txt || { cat said.txt; exit 1; }
# Libraries that are loaded when they are first needed: surf_vtk reads what it wrote, surf_dicom refuses.
"$root/usr/bin/surfseg" evaluate ball.vtp --reference ball.vtp | grep -q "closed, manifold" || fail "no .vtp"
echo no > no.dcm
refused=0
"$root/usr/bin/surfseg" info no.dcm 2> said.txt || refused=$?
[ $refused = 3 ] || { cat said.txt; fail "no DICOM: exit code $refused"; }
if [ -d "$root/usr/lib/python3/dist-packages/surfseg" ] && /usr/bin/python3 -c 'import numpy'; then
  PYTHONPATH=$root/usr/lib/python3/dist-packages /usr/bin/python3 -c '
import surfseg
found = surfseg.segment("ball.nii.gz", [(0, 0, 0)])
assert found.outcome == "converged" and found.volume_ml > 1, found'
fi
if command -v lintian > /dev/null; then
  lintian --fail-on error --suppress-tags bogus-mail-host "$deb" > lintian.txt 2>&1 ||
    { cat lintian.txt; fail "lintian found errors"; }
else
  echo "lintian is missing: not asked"
fi
cd / && rm -rf "$scratch"
