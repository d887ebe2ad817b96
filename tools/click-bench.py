#!/usr/bin/env python3
"""Interactive segmentation by simulated clicks: what Dice and surface agreement are after 1, 2, 3, ... clicks.

    tools/click-bench.py CASES.json [--program build/release/bin/surfseg] [--clicks 10] [--repeats 5] [--fixed-first] [--box MM] [--dialogue] [--expect K=DICE ...]
                         [--json OUT.json] [--plot OUT.svg [--curve NAME:K=DICE,K=DICE,...] ...] [-- MORE OPTIONS]

CASES.json is a list of {"name": ..., "volume": ..., "reference": ..., "seed": [x, y, z]}: paths (relative to the list), a label map on the
volume's grid, and the first click in RAS mm; or the word `phantoms`, which makes a few in a temporary folder.

Protocol, that of the papers on interactive segmentation. Of the voxels that are missing and those that are too many the largest piece that is
connected by faces is taken (of equals what is missing), and its deepest voxel (distance in mm to what is not of it, the border of the volume
included; of equals the lowest index) is clicked, inside or outside. With --repeats above 1 all clicks of the repeats but the first are
drawn, by a fixed seed, from the voxels at least half as deep, the first click from those of the object; with --fixed-first it stays the case's own.
A run that stops at a limit counts with what it has written; of one that fails the result of the click before is kept.
--dialogue adds the clicks one by one to a segmentation of the Python module, which is then to be on PYTHONPATH, where the program is called anew with all of them otherwise.
--box gives it the box of the reference with a margin of so many mm, as a person would draw it.
Printed for each number of clicks: mean Dice, mean share of the surfaces that agree within 2 mm (NSD, at the voxels' faces), how often the verdicts are right; clicks that lost
more than 0.005 and 0.05 of Dice, seconds per call (median, 95 %; the whole program, all clicks from the first on; in a dialogue those of a click); with repeats the spread of the means between them, and the
standard deviation of Dice over the repeats of one object (median of the objects), after one click and after all. --plot draws the means, and beside them
curves that were measured elsewhere. With --expect a mean Dice that is lower after K clicks ends in exit code 1; modules that are missing in 3.

Needs Debian's python3-numpy, python3-scipy, python3-nibabel.
"""
import argparse
import importlib.util
import json
import os
import random
import subprocess
import sys
import tempfile
import time

try:
    import nibabel
    import numpy as np
    from scipy import ndimage
except ImportError as error:
    print("click-bench.py: error: %s; install python3-numpy python3-scipy python3-nibabel" % error, file=sys.stderr)
    sys.exit(3)

from line_plot import line_plot

TOLERANCE_MM = 2.0
WRITTEN = (0, 5)  # exit codes of the program: done, stopped at a limit with the result written


def phantoms(program, folder):
    """Bodies of surfseg phantom with noise: their references are the same without."""
    cases = []
    for kind, seed in (("ball", [0, 0, 0]), ("box", [0, 0, 0]), ("torus", [0.5, 0, 0])):
        clean, noisy = (os.path.join(folder, kind + end) for end in ("-clean.nii", ".nii"))
        reference = os.path.join(folder, kind + "-reference.nii")
        for path, noise in ((clean, "0"), (noisy, "0.1")):
            subprocess.run([program, "phantom", kind, "--size", "48", "--noise", noise, "-o", path],
                           check=True, stdout=subprocess.DEVNULL)
        image = nibabel.load(clean)
        inside = (np.asarray(image.dataobj) > 0.5).astype(np.uint8)
        nibabel.save(nibabel.Nifti1Image(inside, image.affine), reference)
        cases.append(dict(name=kind, volume=noisy, reference=reference, seed=seed))
    return cases


def dice(a, b):
    return 2.0 * np.count_nonzero(a & b) / max(1, np.count_nonzero(a) + np.count_nonzero(b))


def faces(mask):
    """Voxels of the mask beside one that is not of it."""
    return mask & ~ndimage.binary_erosion(mask)


def surface_agreement(a, b, spacing):
    """NSD: share of the voxels on either boundary that have one of the other within the tolerance."""
    if not a.any() or not b.any():
        return 0.0
    on_a, on_b = faces(a), faces(b)
    near = sum(np.count_nonzero(ndimage.distance_transform_edt(~other, sampling=spacing)[one] <= TOLERANCE_MM)
               for one, other in ((on_a, on_b), (on_b, on_a)))
    return near / (np.count_nonzero(on_a) + np.count_nonzero(on_b))


def largest_piece(error):
    labels, n = ndimage.label(error)
    if n == 0:
        return 0, None
    sizes = np.bincount(labels.ravel())[1:]
    return int(sizes.max()), labels == int(sizes.argmax()) + 1


def deep_voxel(piece, spacing, draw):
    """`draw` chooses among those at least half as deep as the deepest; None: the deepest."""
    depth = ndimage.distance_transform_edt(np.pad(piece, 1), sampling=spacing)[1:-1, 1:-1, 1:-1]
    depth = np.rint(depth * 1e6)
    if draw is None:
        at = np.unravel_index(int(depth.argmax()), depth.shape)
    else:
        at = draw.choice(np.argwhere(depth >= 0.5 * depth.max()).tolist())
    return tuple(int(x) for x in at)


def next_click(mask, reference, spacing, draw):
    """(option, voxel), None without an error; see deep_voxel."""
    missing, extra = largest_piece(reference & ~mask), largest_piece(mask & ~reference)
    option, (size, piece) = ("--seed", missing) if missing[0] >= extra[0] else ("--outside", extra)
    if size == 0:
        return None
    return option, deep_voxel(piece, spacing, draw)


def affine_mm(image):
    """To mm: nibabel leaves lengths in the unit that a NIfTI header states."""
    affine = np.array(image.affine, dtype=float)
    if hasattr(image.header, "get_xyzt_units"):
        # Not by that function: it fails at codes that NIfTI does not know, here and of the time.
        unit = int(image.header["xyzt_units"]) & 7
        affine[:3] *= {1: 1e3, 3: 1e-3}.get(unit, 1)  # metres, micrometres
    return affine


class Case:
    def __init__(self, entry, folder):
        path = lambda name: os.path.join(folder, entry[name])
        image = nibabel.load(path("reference"))
        self.name, self.volume, self.seed = entry["name"], path("volume"), entry["seed"]
        self.reference, self.affine = np.asarray(image.dataobj) > 0, affine_mm(image)
        self.spacing = np.sqrt((self.affine[:3, :3] ** 2).sum(axis=0))

    def box(self, margin):
        """Two opposite corners of the reference's box with a margin [mm], as far as the volume goes."""
        at, steps = np.argwhere(self.reference), np.ceil(margin / self.spacing).astype(int)
        corners = np.maximum(0, at.min(0) - steps), np.minimum(np.array(self.reference.shape) - 1, at.max(0) + steps)
        return [tuple(self.point(corner)) for corner in corners]

    def point(self, voxel):
        return self.affine[:3, :3] @ np.array(voxel) + self.affine[:3, 3]


def called(case, arguments, clicks):
    """Mask and summary of the program called with all clicks, (None, {}) if it writes none, and its seconds."""
    with tempfile.TemporaryDirectory() as folder:
        surface, label, summary = (os.path.join(folder, name) for name in ("s.stl", "m.nii.gz", "s.json"))
        command = [arguments.program, "segment", case.volume, "-o", surface, "--mask", label, "--json", summary]
        command += ["%s=%s" % (o, ",".join("%.10g" % x for x in p)) for o, p in clicks]
        if arguments.box is not None:
            command.append("--box=" + ",".join("%.10g" % x for corner in case.box(arguments.box) for x in corner))
        begin = time.monotonic()
        code = subprocess.run(command + arguments.more, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
        seconds = time.monotonic() - begin
        if code not in WRITTEN:
            return None, {}, seconds
        with open(summary) as file:
            return np.asarray(nibabel.load(label).dataobj) > 0, json.load(file), seconds


class Dialogue:
    """One segmentation of the Python module, to which clicks are added: seconds are those of a click and its evolution."""

    def __init__(self, case, arguments):
        self.surfseg = importlib.import_module("surfseg")
        self.segmentation = self.surfseg.Segmentation(case.volume)
        if arguments.box is not None:
            self.segmentation.set_options(box=case.box(arguments.box))

    def __call__(self, clicks):
        option, point = clicks[-1]
        begin = time.monotonic()
        try:
            self.segmentation.click(tuple(point), option == "--seed")
            surface = self.segmentation.evolve()
        except self.surfseg.Error:
            return None, {}, time.monotonic() - begin
        seconds = time.monotonic() - begin
        return surface.mask() > 0, surface.report, seconds


def run(case, arguments, repeat):
    """Dice, NSD and seconds of each call."""
    draw = random.Random(repeat) if repeat else None
    first = case.seed
    if draw and not arguments.fixed_first:
        first = list(case.point(deep_voxel(case.reference, case.spacing, draw)))
    rows, clicks = [], [("--seed", first)]
    mask = np.zeros(case.reference.shape, bool)
    segment = Dialogue(case, arguments) if arguments.dialogue else lambda clicks: called(case, arguments, clicks)
    while len(rows) < arguments.clicks:
        now, summary, seconds = segment(clicks)
        mask = mask if now is None else now  # of a call that failed that of the click before is kept
        verdict = summary.get("verdict") or {}
        rows.append(dict(dice=dice(mask, case.reference), failed=now is None, seconds=seconds, trust=verdict.get("trust"),
                         likelihood=verdict.get("likelihood"), nsd=surface_agreement(mask, case.reference, case.spacing)))
        following = next_click(mask, case.reference, case.spacing, draw)
        # Nothing is left, or a click was not heeded: the same again changes nothing.
        point = None if following is None else list(case.point(following[1]))
        if following is None or any(np.allclose(point, p) for _, p in clicks):
            rows += [dict(rows[-1], seconds=None)] * (arguments.clicks - len(rows))
            break
        clicks.append((following[0], point))
    return rows


def report_verdicts(rows):
    """How often the program's verdicts are right, which is a Dice of 0.8 or more."""
    is_right, is_poor = (lambda row: row["dice"] >= 0.8), (lambda row: row["dice"] < 0.6)
    of = {trust: [row for row in rows if row["trust"] == trust] for trust in ("trusted", "check", "doubtful")}
    count = lambda test, group: sum(map(test, group))
    known = sum(of.values(), [])
    if known:
        print("  %s; of %d right ones %d trusted, of %d below 0.6 %d doubtful" % (
            ", ".join("%s: right in %d of %d" % (trust, count(is_right, group), len(group)) for trust, group in of.items()),
            count(is_right, known), count(is_right, of["trusted"]), count(is_poor, known), count(is_poor, of["doubtful"])))


def report(results, n_clicks):
    rows = [row for case in results for row in case["repeats"]]
    print("clicks   Dice    NSD")
    for k in sorted({1, 2, 3, 5, 10, n_clicks} & set(range(1, n_clicks + 1))):
        print("%6d  %.3f  %.3f" % (k, np.mean([r[k - 1]["dice"] for r in rows]),
                                   np.mean([r[k - 1]["nsd"] for r in rows])))
        report_verdicts([r[k - 1] for r in rows])
    losses = np.array([a["dice"] - b["dice"] for r in rows for a, b in zip(r, r[1:]) if b["seconds"] is not None])
    if losses.size:
        print("clicks that lost more than 0.005: %.1f %%, more than 0.05: %d of %d"
              % (100 * np.mean(losses > 0.005), np.count_nonzero(losses > 0.05), losses.size))
    n_repeats = len(results[0]["repeats"])
    for k in sorted({1, n_clicks}) if n_repeats > 1 else []:
        of_repeats = [np.mean([case["repeats"][n][k - 1]["dice"] for case in results]) for n in range(n_repeats)]
        deviations = [np.std([r[k - 1]["dice"] for r in case["repeats"]], ddof=1) for case in results]
        print("after %d: means of the repeats %.3f to %.3f, deviation in one object %.3f (median)"
              % (k, min(of_repeats), max(of_repeats), np.median(deviations)))
    seconds = [x["seconds"] for r in rows for x in r if x["seconds"] is not None]
    print("seconds per call: median %.2f, 95 %% %.2f" % (np.median(seconds), np.percentile(seconds, 95)))
    first = [r[0]["seconds"] for r in rows]
    further = [x["seconds"] for r in rows for x in r[1:] if x["seconds"] is not None]
    if further:
        print("  first %.2f, %.2f; further %.2f, %.2f" % (np.median(first), np.percentile(first, 95),
                                                          np.median(further), np.percentile(further, 95)))


def curve(text):
    """NAME:K=DICE,K=DICE,... as (NAME, [(K, DICE), ...])."""
    name, _, points = text.rpartition(":")
    out = [(int(k), float(dice)) for k, dice in (point.split("=") for point in points.split(","))]
    if not name or not all(k >= 1 and 0 <= dice <= 1 for k, dice in out):
        raise ValueError(text)
    return name, out


def plot(curves):
    last = max(k for points in curves.values() for k, _ in points)
    lowest = int(10 * min(dice for points in curves.values() for _, dice in points))
    return line_plot(curves, "mean Dice after so many clicks", [(k, k) for k in range(1, max(last, 2) + 1)],
                     [(tenth / 10, "%.1f" % (tenth / 10)) for tenth in range(min(lowest, 9), 11)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases")
    parser.add_argument("--program", default="build/release/bin/surfseg")
    parser.add_argument("--clicks", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--fixed-first", action="store_true")
    parser.add_argument("--box", type=float, metavar="MM")
    parser.add_argument("--dialogue", action="store_true")
    parser.add_argument("--expect", action="append", default=[], metavar="K=DICE")
    parser.add_argument("--json")
    parser.add_argument("--plot", metavar="OUT.svg")
    parser.add_argument("--curve", action="append", default=[], type=curve, metavar="NAME:K=DICE,...")
    argv, more = sys.argv[1:], []
    if "--" in argv:
        argv, more = argv[:argv.index("--")], argv[argv.index("--") + 1:]
    arguments = parser.parse_args(argv)
    arguments.more = more
    if arguments.dialogue and (more or importlib.util.find_spec("surfseg") is None):
        parser.error("--dialogue: the module surfseg is not on PYTHONPATH, or there are options for the program")
    if arguments.clicks < 1 or arguments.repeats < 1:
        parser.error("--clicks and --repeats: 1 or more")
    expected = []
    for text in arguments.expect:
        k, _, least = text.partition("=")
        if not (k.isdigit() and 1 <= int(k) <= arguments.clicks and least):
            parser.error("--expect %s: expected K=DICE, K up to --clicks" % text)
        expected.append((int(k), float(least)))
    with tempfile.TemporaryDirectory() as folder:
        if arguments.cases == "phantoms":
            cases = phantoms(arguments.program, folder)
        else:
            with open(arguments.cases) as file:
                cases = json.load(file)
            folder = os.path.dirname(os.path.abspath(arguments.cases))
        results = []
        for entry in cases:
            case = Case(entry, folder)
            repeats = [run(case, arguments, repeat) for repeat in range(arguments.repeats)]
            results.append(dict(name=case.name, repeats=repeats))
            print("%-30s %s" % (case.name, " ".join("%.3f" % x["dice"] for x in repeats[0])), flush=True)
    report(results, arguments.clicks)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(results, file, indent=1)
    if arguments.plot:
        means = np.mean([[row["dice"] for row in rows] for case in results for rows in case["repeats"]], axis=0)
        with open(arguments.plot, "w") as file:
            file.write(plot({"surfseg": [(k, dice) for k, dice in enumerate(means, 1)], **dict(arguments.curve)}))
    for k, least in expected:
        mean = np.mean([rows[k - 1]["dice"] for case in results for rows in case["repeats"]])
        if not mean >= least:
            sys.exit("click-bench.py: error: mean Dice after %d clicks: expected %g or more; got %.4f" % (k, least, mean))


if __name__ == "__main__":
    main()
