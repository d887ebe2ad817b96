"""tools/bench.py: what it tells of the programs that it times; "skipped" without numpy, which it needs."""
import importlib.util
import pathlib
import subprocess
import sys
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


if __name__ == "__main__":
    unittest.main()
