"""tools/evaluate-real.sh with a stand-in for surfseg; "skipped" without jq."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "tools/evaluate-real.sh"

if shutil.which("jq") is None:
    print("skipped: there is no jq")
    sys.exit(77)

# In place of surfseg: what it cannot do with a scan or a mask, their names say.
STAND_IN = """#!/usr/bin/python3
import json, sys
words = sys.argv[1:]
if words == ["--version"]:
    print("surfseg 9.9")
    sys.exit()
after = lambda option: words[words.index(option) + 1]
if words[0] == "segment":
    if "broken" in words[1]:
        sys.exit("surfseg: error: a | b")
    open(after("-o"), "w").close()
    with open(after("--json"), "w") as file:
        json.dump({"triangles": 8, "min_angle_deg": 30, "time_s": 1, "outcome": "converged", "stop_message": "at rest"}, file)
elif "broken" in after("--reference"):
    sys.exit("surfseg: error: no mask")
else:
    dice = None if "empty" in after("--reference") else 0.9
    with open(after("--json"), "w") as file:
        json.dump({"dice": dice, "volume_difference_percent": None, "distance": {"mean_mm": 1, "p95_mm": 2}}, file)
"""


class EvaluateReal(unittest.TestCase):
    def test_a_run_that_fails_is_a_row_and_the_others_go_on(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder, "surfseg")
            program.write_text(STAND_IN)
            program.chmod(0o755)
            rows = [("broken.nii", "m.nii"), ("a.nii", "broken.nii"), ("b.nii", "empty.nii"), ("c.nii", None), ("d.nii", "m.nii")]
            entries = [{"volume": volume, "structure": "s", "mask": mask, "calm_seed_ras_mm": [1, 2, 3]} for volume, mask in rows]
            pathlib.Path(folder, "seeds.json").write_text(json.dumps({"entries": entries}))
            output = pathlib.Path(folder, "results.md")
            done = subprocess.run([SCRIPT, folder, output], env={**os.environ, "SURFSEG": str(program)},
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            page = output.read_text()
        first = page[:page.index("## With a preset")]
        self.assertEqual([line for line in first.splitlines() if ".nii |" in line], [
            "| broken.nii | s | - | - | - | - | - | - | - | exit 1: surfseg: error: a / b |",
            "| a.nii | s | - | - | - | - | - | - | - | evaluate: exit 1: surfseg: error: no mask |",
            "| b.nii | s | **-** | - | 1 | 2 | 8 | 30 | 1 | converged: at rest |",
            "| d.nii | s | **0.9** | - | 1 | 2 | 8 | 30 | 1 | converged: at rest |"])


if __name__ == "__main__":
    unittest.main()
