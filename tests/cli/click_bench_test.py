"""tools/click-bench.py: where it clicks; "skipped" without the modules that it needs."""
import importlib.util
import os
import pathlib
import sys
import tempfile
import unittest

missing = [m for m in ("numpy", "nibabel", "scipy") if importlib.util.find_spec(m) is None]
if missing:
    print("skipped: there is no", ", ".join(missing))
    sys.exit(77)

import nibabel  # noqa: E402
import numpy as np  # noqa: E402

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"
sys.path.insert(0, str(TOOLS))  # of what it imports from there


class ClickBench(unittest.TestCase):
    # Clicks in micrometres, which the program took for mm.
    def test_clicks_and_boxes_are_in_mm_whatever_the_unit_of_the_reference(self):
        found = importlib.util.spec_from_file_location("click_bench", TOOLS / "click-bench.py")
        bench = importlib.util.module_from_spec(found)
        found.loader.exec_module(bench)
        labels = np.zeros((6, 7, 8), np.uint8)
        labels[2:4, 3:5, 4:6] = 1
        affine = np.diag([-0.5, 0.75, 2, 1])
        affine[:3, 3] = 10, -20, 30
        entry = dict(name="a", volume="v.nii", reference="r.nii", seed=[0, 0, 0])
        with tempfile.TemporaryDirectory() as folder:
            for code, mm in ((0, 1), (1, 1e3), (2, 1), (3, 1e-3), (10, 1), (7, 1)):
                image = nibabel.Nifti1Image(labels, np.diag([1 / mm] * 3 + [1]) @ affine)
                image.header["xyzt_units"] = code
                nibabel.save(image, os.path.join(folder, "r.nii"))
                case = bench.Case(entry, folder)
                for got, expected in ((case.spacing, [0.5, 0.75, 2]),
                                      (case.point((2, 3, 4)), [9, -17.75, 38]),
                                      (case.box(1), [[10, -19.25, 36], [7.5, -15.5, 42]])):
                    np.testing.assert_allclose(got, expected, 1e-6, err_msg=f"code {code}")


if __name__ == "__main__":
    unittest.main()
