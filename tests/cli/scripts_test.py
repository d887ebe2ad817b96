"""tools/bench.py and tools/check.sh with stand-ins for what they call, and tools/click-bench.py;
"skipped" where numpy or git is missing."""
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"

missing = [m for m in ("numpy",) if importlib.util.find_spec(m) is None]
missing += [p for p in ("git",) if shutil.which(p) is None]
if missing:
    print("skipped: there is no", ", ".join(missing))
    sys.exit(77)

sys.path.insert(0, str(TOOLS))
import bench  # noqa: E402


class Bench(unittest.TestCase):
    # More on stderr than a pipe holds: it was "too slow".
    def test_a_program_may_write_a_lot_to_both_streams(self):
        n = 1 << 20
        program = f"import sys; sys.stderr.write('e' * {n}); sys.stdout.write('o' * {n})"
        out, peak = bench.run([sys.executable, "-c", program], 60)
        self.assertEqual(out, "o" * n)
        self.assertGreater(peak, 1)

    def test_what_a_failure_says_is_kept(self):
        with self.assertRaises(subprocess.CalledProcessError) as failure:
            bench.run([sys.executable, "-c", "import sys; sys.exit('no such volume')"], 60)
        self.assertEqual(failure.exception.returncode, 1)
        self.assertEqual(failure.exception.stderr, b"no such volume\n")

    def test_what_takes_longer_than_the_limit_is_ended(self):
        with self.assertRaises(bench.TooSlow):
            bench.run([sys.executable, "-c", "import time; time.sleep(60)"], 0.2)


@unittest.skipIf(any(importlib.util.find_spec(m) is None for m in ("nibabel", "scipy")),
                 "there is no nibabel or scipy")
class ClickBench(unittest.TestCase):
    # Clicks in micrometres, which the program took for mm.
    def test_clicks_and_boxes_are_in_mm_whatever_the_unit_of_the_reference(self):
        import nibabel
        import numpy as np

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


# In place of ctest: $LIST is what it lists, $SAYS what a run prints; $FAILS the one of the two that
# ends with an exit code of its own.
CTEST = """#!/bin/bash
case " $* " in
  *' -N '*) printf "$LIST"; [[ $FAILS != list:* ]] || exit "${FAILS#*:}" ;;
  *) printf "$SAYS"; [[ $FAILS != run:* ]] || exit "${FAILS#*:}" ;;
esac
"""
LIST = "  Test  #1: A.B\\n  Test  #2: C.D\\n  Test  #3: E_NOT_BUILT\\n\\nTotal Tests: 3\\n"
FIRST = "1/2 Test #1: A.B .......   Passed    0.01 sec\\n"


class Check(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        root = pathlib.Path(self.folder.name)
        for name in ("libsurf", "libcurve", "tools", "tests", "cmake", "build/asan", "bin"):
            (root / name).mkdir(parents=True)
        for name in ("CMakeLists.txt", "CMakePresets.json"):
            (root / name).touch()
        shutil.copy(TOOLS / "check.sh", root / "tools")
        for name, text in (("cmake", "#!/bin/bash\n"), ("ctest", CTEST)):
            (root / "bin" / name).write_text(text)
            (root / "bin" / name).chmod(0o755)
        subprocess.run(["git", "init", "-q", root], check=True, stderr=subprocess.DEVNULL)
        self.root = root

    def check(self, list=LIST, says="", fails=""):
        environment = dict(os.environ, LIST=list, SAYS=says, FAILS=fails,
                           PATH=f"{self.root}/bin:{os.environ['PATH']}")
        done = subprocess.run([self.root / "tools/check.sh", "asan"], env=environment, text=True,
                              capture_output=True)
        return done.returncode, done.stdout

    def test_all_that_passes_is_no_finding(self):
        says = FIRST + "2/2 Test #2: C.D .......   Passed    0.01 sec\\n"
        code, out = self.check(says=says)
        self.assertEqual(code, 0, out)
        self.assertIn("2 tests passed, 0 failed", out)
        # What has passed is not asked for again.
        self.assertEqual(self.check(fails="run:1"), (0, out))

    def test_a_test_that_fails_is_counted(self):
        code, out = self.check(says=FIRST + "2/2 Test #2: C.D .......***Failed    0.01 sec\\n",
                               fails="run:8")
        self.assertEqual(code, 1)
        self.assertIn("1 tests passed, 1 failed", out)
        self.assertNotIn("ctest ended", out)

    # These were "0 tests passed, 0 failed", and no finding.
    def test_no_list_is_a_finding(self):
        for list, fails in (("", "list:1"), (LIST, "list:1"), ("Total Tests: 0\\n", ""),
                            ("  Test  #3: E_NOT_BUILT\\n", "")):
            code, out = self.check(list=list, fails=fails)
            self.assertEqual(code, 1, out)
            self.assertIn("asan: ctest lists no tests; see build/check/asan.log", out)

    def test_a_run_that_fails_of_itself_is_a_finding(self):
        code, out = self.check(says=FIRST, fails="run:137")
        self.assertEqual(code, 1, out)
        self.assertIn("1 tests passed, 0 failed", out)
        self.assertIn("asan: ctest ended with exit code 137", out)


if __name__ == "__main__":
    unittest.main()
