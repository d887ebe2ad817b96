"""tools/check.sh with stand-ins for what it calls; "skipped" without git."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"

if shutil.which("git") is None:
    print("skipped: there is no git")
    sys.exit(77)

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

    # A new file was not asked for, as long as git did not know it, nor were data and pages.
    def test_what_changes_is_looked_at_anew(self):
        both = FIRST + "2/2 Test #2: C.D .......   Passed    0.01 sec\\n"
        for name in ("tests/new_test.cpp", "data/presets/new.json", "docs/new.md"):
            self.check(says=both)
            for text in ("one", "two"):
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                (self.root / name).write_text(text)
                self.assertIn("1 tests passed", self.check(says=FIRST)[1], name)
                self.check(says=both)
            (self.root / name).unlink()
            self.assertIn("1 tests passed", self.check(says=FIRST)[1], name)

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
