#!/usr/bin/python3
"""Kills (SIGKILL) of segment, batch and studio at random moments: kill_test.py [KILLS OF EACH]

What is there after a kill is whole or absent, and the same command once more, with --resume where there is one, ends in the bytes of a run that nobody
disturbed. Moments are drawn evenly over the time that such a run takes. Prints a line for each program.
"""
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "studio"))
from studio import Studio, phantom  # noqa: E402

PROGRAM = os.environ["SURFSEG_PROGRAM"]


def contents(folder):
    out = {}
    for path, _, names in os.walk(folder):
        for name in names:
            full = os.path.join(path, name)
            with open(full, "rb") as file:
                out[os.path.relpath(full, folder)] = file.read()
    return out


def start(words, folder):
    return subprocess.Popen([PROGRAM, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def run(words, folder):
    done = subprocess.run([PROGRAM, *words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, (words, done.returncode, done.stderr)


def killed(words, folder, seconds):
    """Whether it was still running."""
    process = start(words, folder)
    try:
        process.wait(seconds)
        return False
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
        return True


def timed(words, folder):
    begin = time.monotonic()
    run(words, folder)
    return time.monotonic() - begin


def of_segment(folder, draw, n_kills):
    phantom(folder, "v.nii", "ball", "--size", "48", "--spacing", "1", "--noise", "0.1")
    words = ["segment", "v.nii", "--seed", "1,0,0", "--levels", "2", "-q", "-o", "a.stl", "--mask", "a.nii.gz", "--recipe", "a.json", "--report", "a.html"]
    files = ["a.stl", "a.nii.gz", "a.json"]  # a report says how long it took
    duration = timed(words, folder)
    whole = {name: contents(folder)[name] for name in files}
    kept = [*words, "--checkpoint", "c.json", "--resume"]
    n_killed = 0
    while n_killed < n_kills:
        for name in [*files, "a.html"]:
            if os.path.exists(os.path.join(folder, name)):
                os.remove(os.path.join(folder, name))
        for _ in range(2):  # the second one meets the run that goes on
            n_killed += killed(kept, folder, draw.uniform(0, duration))
            for name, data in contents(folder).items():
                assert name not in whole or data == whole[name], f"{name} is not whole after a kill"
                assert name != "a.html" or data.rstrip().endswith(b"</html>"), "the report is not whole after a kill"
        run(kept, folder)
        now = contents(folder)
        assert all(now[name] == whole[name] for name in files), "other bytes after --resume"
        left = set(now) - {"v.nii", *files, "a.html"}
        assert all(name.startswith(".") or ".tmp" in name for name in left), f"left behind: {left}"
        for name in left:
            os.remove(os.path.join(folder, name))
    return n_killed


def of_batch(folder, draw, n_kills):
    rows = ["name\tscan\tclicks"]
    for n in range(4):
        phantom(folder, f"{n}.nii.gz", "ball", "--size", "24", "--spacing", "1", "--noise", "0.02", "--random-seed", str(n))
        rows.append(f"case{n}\t{n}.nii.gz\t0,0,0")
    with open(os.path.join(folder, "list.tsv"), "w") as file:
        file.write("\n".join(rows) + "\n")
    duration = timed(["batch", "list.tsv", "-o", "whole", "-q"], folder)
    whole = contents(os.path.join(folder, "whole"))
    words = ["batch", "list.tsv", "-o", "out", "-q"]
    n_killed = 0
    while n_killed < n_kills:
        shutil.rmtree(os.path.join(folder, "out"), ignore_errors=True)
        for _ in range(3):
            n_killed += killed(words, folder, draw.uniform(0, duration))
            for name, data in contents(os.path.join(folder, "out")).items():
                if name in whole and not name.startswith("group."):
                    assert data == whole[name], f"{name} is not whole after a kill"
        run(words, folder)
        now = contents(os.path.join(folder, "out"))
        missing = set(whole) - set(now)
        assert not missing, f"missing: {missing}"
        other = [name for name in whole if now[name] != whole[name]]
        assert not other, f"other bytes: {other}"
    return n_killed


def of_studio(folder, draw, n_kills):
    phantom(folder, "v.nii.gz", "separate-balls", "--size", "40", "--noise", "0.05")
    clicks = [((-0.5, 0, 0), "inside"), ((0.5, 0, 0), "inside"), ((0, 0, 0), "outside")]
    kept = os.path.join(folder, "v.nii.gz.surfseg.json")
    ends = []  # the surface after so many clicks
    duration = 0
    for n in range(1, len(clicks) + 1):
        with Studio(folder, "v.nii.gz") as studio:
            studio.idle()
            begin = time.monotonic()
            for point, side in clicks[:n]:
                studio.click(point, side)
                studio.idle()
            duration = (time.monotonic() - begin) / n
            ends.append(studio.get("/api/surface?object=1"))
        os.remove(kept)
    n_killed = 0
    while n_killed < n_kills:
        n = draw.randint(1, len(clicks))
        with Studio(folder, "v.nii.gz") as studio:
            studio.idle()
            for point, side in clicks[:n - 1]:
                studio.click(point, side)
                studio.idle()
            studio.click(*clicks[n - 1])
            time.sleep(draw.uniform(0, duration))
            studio.process.kill()
        n_killed += 1
        with Studio(folder, "v.nii.gz") as again:
            state = again.idle()
            sides = [click["side"] for click in state["objects"][0]["clicks"]]
            assert sides == [side for _, side in clicks[:n]], f"{n} clicks were accepted, there are {sides}"
            assert again.get("/api/surface?object=1") == ends[n - 1], "another surface"
        os.remove(kept)
        left = set(os.listdir(folder)) - {"v.nii.gz"}
        assert all(name.startswith(".") or ".tmp" in name for name in left), f"left behind: {left}"
        for name in left:
            os.remove(os.path.join(folder, name))
    return n_killed


def main():
    n_kills = int(sys.argv[1]) if len(sys.argv) > 1 else 67
    n_failed = 0
    for kind in (of_segment, of_batch, of_studio):
        if kind is of_studio and os.environ.get("SURFSEG_WITHOUT_STUDIO"):
            print("skipped: the studio was not built")
            continue
        folder = tempfile.mkdtemp(prefix="surfseg-kills-")
        name = kind.__name__.removeprefix("of_")
        try:
            print(f"{name}: {kind(folder, random.Random(7), n_kills)} kills, all files whole or absent, the same bytes at the end", flush=True)
        except Exception as error:
            n_failed += 1
            print(f"{name}: FAILED: {error}", flush=True)
        shutil.rmtree(folder)
    return 1 if n_failed else 0


if __name__ == "__main__":
    sys.exit(main())
