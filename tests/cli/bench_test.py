"""tools/bench.py: what it tells of the programs that it times; "skipped" without numpy, which it needs."""
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import unittest

if importlib.util.find_spec("numpy") is None:
    print("skipped: there is no numpy")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
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

    # It was found out when all had been timed.
    def test_a_page_without_a_place_for_the_table_is_refused_before_the_work(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, "page.md")
            for text in (None, "no markers", bench.END + bench.BEGIN):
                if text is not None:
                    page.write_text(text)
                done = subprocess.run([sys.executable, bench.__file__, "--surfseg", "none", "--peers", "none", "-o", page],
                                      capture_output=True, text=True)
                self.assertEqual(done.returncode, 1)
                self.assertIn(f"bench.py: {page}: ", done.stderr)
                self.assertNotIn("Traceback", done.stderr)
            page.write_text(f"a {bench.BEGIN} old {bench.END} b")
            bench.write_document(page, "new")
            self.assertEqual(page.read_text(), f"a {bench.BEGIN}\nnew\n{bench.END} b")

    def test_a_case_that_no_program_has_done_has_no_plot(self):
        row = {"case": "ball", "n": 64, "program": "p"}
        self.assertIsNone(bench.plot([dict(row, failure="over 1 s")], "ball"))
        self.assertIn("<svg", bench.plot([dict(row, cpu_s=1.0)], "ball"))


if __name__ == "__main__":
    unittest.main()
