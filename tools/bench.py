"""Times surfseg and its peers on phantoms; called by tools/bench.sh, which builds the peers.

Every program gets the same uncompressed volume. Times are from the volume in memory to the mesh,
mask or level set (surfseg: to the verified mesh), medians over the runs with the least and the
largest; memory is the process' largest resident set. Errors are distances of the surface from the
phantom's, by area, in voxels. What takes longer than the limit is stopped and said to; a peer that
by its time at the size before, times the voxels' ratio, would take longer is not begun.
"""
import argparse
import json
import math
import multiprocessing
import os
import pathlib
import re
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

try:
    import numpy as np
except ImportError:
    print("skipped: bench.sh needs python3-numpy", file=sys.stderr)
    sys.exit(3)

from line_plot import line_plot

ROOT = pathlib.Path(__file__).resolve().parent.parent
SLOW = 60  # [s]: what takes longer is run once
BEGIN, END = "<!-- bench -->", "<!-- /bench -->"


# The phantoms of `surfseg phantom`, on [-1, 1]^3 mm: distances, and volumes [mm^3].
def ball(p):
    return np.linalg.norm(p, axis=1) - 0.6


def torus(p):
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.5, p[:, 2]) - 0.2


def box(p):
    q = np.abs(p) - np.array([0.6, 0.4, 0.3])
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


SHAPES = {"ball": (ball, 4 / 3 * math.pi * 0.6**3, "0,0,0"),
          "torus": (torus, 2 * math.pi**2 * 0.5 * 0.2**2, "0.5,0,0"),
          "box": (box, 8 * 0.6 * 0.4 * 0.3, "0,0,0")}
CASES = [("ball", 0), ("ball", 0.1), ("torus", 0.1), ("box", 0)]

# Ellipsoids (centre, half-axes [mm], Hounsfield units) of a scan made like a CT of the trunk, each
# upon those before it; the last is the one to segment.
TRUNK = [((0, 0, 0), (170, 120, 1e4), -90), ((0, 0, 0), (155, 105, 1e4), 45),
         ((-75, -5, 60), (55, 70, 85), -850), ((75, -5, 60), (55, 70, 85), -850),
         ((-60, 10, -70), (60, 60, 55), 110), ((0, -75, 0), (22, 18, 1e4), 250),
         ((25, -45, 0), (12, 12, 1e4), 200), ((70, -40, -80), (14, 12, 24), 150)]
TRUNK_NOISE, TRUNK_BLUR = 20, 0.8  # HU; pixels


def write_nifti(path, values, spacing):
    """Voxels [k, j, i] of int16, the middle of the volume at the origin."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *values.shape[::-1], 1, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 4, 16)
    struct.pack_into("<8f", header, 76, 1, *spacing, 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352)
    struct.pack_into("<2h", header, 252, 0, 1)
    header[123] = 2  # mm
    for axis in range(3):
        row = [0.0] * 4
        row[axis] = spacing[axis]
        row[3] = -spacing[axis] * (values.shape[2 - axis] - 1) / 2
        struct.pack_into("<4f", header, 280 + 16 * axis, *row)
    header[344:348] = b"n+1\0"
    with open(path, "wb") as file:
        file.write(header)
        file.write(values.astype("<i2").tobytes())


def make_trunk(path, size, spacing):
    axes = [s * (np.arange(n) - (n - 1) / 2) for n, s in zip(size, spacing)]
    x, y = np.meshgrid(axes[0], axes[1])
    random = np.random.default_rng(1)
    kernel = np.exp(-0.5 * (np.arange(-3, 4) / TRUNK_BLUR) ** 2)
    kernel /= kernel.sum()
    out = np.empty(size[::-1], np.int16)
    for k, z in enumerate(axes[2]):
        plane = np.full(x.shape, -1000.0)
        for (cx, cy, cz), (a, b, c), value in TRUNK:
            plane[((x - cx) / a) ** 2 + ((y - cy) / b) ** 2 + ((z - cz) / c) ** 2 < 1] = value
        for axis in (0, 1):
            padded = np.pad(plane, [(3, 3) if a == axis else (0, 0) for a in (0, 1)], "edge")
            plane = sum(w * np.take(padded, range(i, i + plane.shape[axis]), axis)
                        for i, w in enumerate(kernel))
        out[k] = np.clip(plane + random.normal(0, TRUNK_NOISE, plane.shape), -1024, 3071)
    write_nifti(path, out, spacing)


def trunk_distance(p):
    """To first order: the ellipsoid's function over its slope."""
    centre, axes, _ = TRUNK[-1]
    u = (p - np.array(centre)) / np.array(axes)
    f = np.linalg.norm(u, axis=1)
    return (f - 1) * f / np.linalg.norm(u / np.array(axes), axis=1)


def read_stl(path):
    data = np.fromfile(path, np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)),
                                       ("flags", "<u2")]), offset=84)
    corners = data["corner"].astype(float)
    corners[:, :, :2] *= -1  # LPS in the file
    return corners


def read_off(path):
    lines = open(path).read().split("\n")
    n_points, n_faces, _ = map(int, lines[1].split())
    rows = [line for line in lines[2:] if line.strip()]
    points = np.array([row.split() for row in rows[:n_points]], float)
    faces = np.array([row.split()[1:4] for row in rows[n_points:n_points + n_faces]], int)
    return points[faces]


def isosurface(values, level, spacing, origin):
    from skimage.measure import marching_cubes

    if not values.min() < level < values.max():
        return None
    points, triangles, _, _ = marching_cubes(values, level)
    return (origin + spacing * points[:, ::-1])[triangles]


def errors(corners, distance, voxel, volume):
    """Mean and 95th percentile of the distance by area [voxels], and the volume's error [%]."""
    if corners is None or len(corners) == 0:
        return None
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    cross = np.cross(b - a, c - a)
    area = np.linalg.norm(cross, axis=1) / 2
    samples = [np.abs(distance(w[0] * a + w[1] * b + w[2] * c))
               for w in ((2 / 3, 1 / 6, 1 / 6), (1 / 6, 2 / 3, 1 / 6), (1 / 6, 1 / 6, 2 / 3))]
    d, weight = np.concatenate(samples) / voxel, np.tile(area, 3)
    order = np.argsort(d)
    cumulated = np.cumsum(weight[order])
    at = np.searchsorted(cumulated, 0.95 * cumulated[-1])
    enclosed = abs(np.einsum("ij,ij->i", a, cross).sum()) / 6
    return {"mean_voxel": float((d * weight).sum() / weight.sum()),
            "p95_voxel": float(d[order][at]), "volume_percent": 100 * (enclosed / volume - 1),
            "triangles": len(corners)}


class TooSlow(Exception):
    pass


def apart(function):
    """Its result, from a process of its own. Largest resident sets of children begin with that of
    their parent: this one has to stay small."""
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=lambda: there.send(function()))
    process.start()
    there.close()
    try:
        result = here.recv()
    except EOFError:
        raise SystemExit("bench.py: a part that reads or makes data failed, see above")
    process.join()
    return result


def run(command, limit):
    """Standard output and largest resident set [MB]; raises TooSlow, CalledProcessError."""
    # A second pipe would fill while the first one is read, and the process wait for the limit.
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE,
                                   stderr=errors)
        timer = threading.Timer(limit, process.kill)
        timer.start()
        with process.stdout as stream:
            out = stream.read()
        _, status, usage = os.wait4(process.pid, 0)
        errors.seek(0)
        error = errors.read()
    process.returncode = os.waitstatus_to_exitcode(status)
    is_late = not timer.is_alive()
    timer.cancel()
    if is_late:
        raise TooSlow
    if process.returncode != 0:
        raise subprocess.CalledProcessError(process.returncode, command, out, error)
    return out.decode(), usage.ru_maxrss / 1024


class Surfseg:
    def __init__(self, name, program, options):
        self.name, self.program, self.options = name, program, options

    def is_there(self):
        return True

    def run(self, scene, work, limit):
        stl, summary = work / "s.stl", work / "s.json"
        _, peak = run([self.program, "segment", scene["path"], f"--seed={scene['seed']}", "-o", stl,
                       "--json", summary, "--quiet", *self.options], limit)
        stages = json.loads(summary.read_text())["stages"]
        parts = [stages["segment"], stages["verify"]]
        return {"wall_s": sum(p["time_s"] for p in parts), "cpu_s": sum(p["cpu_s"] for p in parts),
                "peak_mb": peak}, lambda: read_stl(stl)


class Itk:
    name = "ITK, geodesic active contour"

    def __init__(self, peers):
        self.program = peers / "itk_geodesic"

    def is_there(self):
        return self.program.exists() and has_module("skimage")

    def run(self, scene, work, limit):
        out, peak = run([self.program, scene["path"], scene["seed"], work / "phi.raw"], limit)
        n = scene["n"]

        def corners():
            phi = np.fromfile(work / "phi.raw", np.float32).reshape(n, n, n)
            return isosurface(phi, 0, 2 / (n - 1), -1)

        return {**json.loads(out), "peak_mb": peak}, corners


class Cgal:
    name = "CGAL, surface mesher (told the value)"

    def __init__(self, peers):
        self.program = peers / "cgal_mesher"

    def is_there(self):
        return self.program.exists()

    def run(self, scene, work, limit):
        out, peak = run([self.program, scene["path"], 0.5, scene["seed"], work / "s.off"], limit)
        return {**json.loads(out), "peak_mb": peak}, lambda: read_off(work / "s.off")


class PythonPeer:
    def __init__(self, name, method, module, largest=10**9):
        self.name, self.method, self.module, self.largest = name, method, module, largest

    def is_there(self):
        return has_module(self.module) and (self.module != "vtk" or has_module("vtk"))

    def run(self, scene, work, limit):
        if scene["n"] > self.largest:
            raise TooSlow
        out, peak = run([sys.executable, ROOT / "tests/bench/peers/python_peers.py", self.method,
                         scene["path"], scene["seed"], work / "s.npz"], limit)

        def corners():
            result = np.load(work / "s.npz")
            if "points" in result:
                return result["points"].astype(float)[result["triangles"]]
            return isosurface(result["mask"], 0.5, 2 / (scene["n"] - 1), -1)

        return {**json.loads(out), "peak_mb": peak}, corners


def has_module(name):
    return subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode == 0


def measure(program, scene, a, work):
    runs, corners, began = [], None, time.monotonic()
    for _ in range(a.runs):
        times, corners = program.run(scene, work, a.limit)
        runs.append(times)
        if time.monotonic() - began > SLOW:
            break
    row = {key: statistics.median(r[key] for r in runs) for key in ("wall_s", "cpu_s", "peak_mb")}
    row["wall_range_s"] = [min(r["wall_s"] for r in runs), max(r["wall_s"] for r in runs)]
    row["runs"] = len(runs)
    found = apart(lambda: errors(corners(), scene["distance"], scene["voxel"], scene["volume"]))
    return {**row, **found} if found else {**row, "failure": "ends at nothing"}


def scenes(a, work):
    for shape, noise in CASES:
        for n in a.sizes:
            if a.light and (shape, noise) not in (("ball", 0), ("box", 0)):
                continue
            path = work / "v.nii"
            run([a.surfseg, "phantom", shape, "--size", n, "--noise", noise, "-o", path], 600)
            distance, volume, seed = SHAPES[shape]
            yield {"case": ("noisy " if noise else "") + shape, "n": n, "path": path, "seed": seed,
                   "distance": distance, "volume": volume, "voxel": 2 / (n - 1), "phantom": True}
    if not a.light:
        size, spacing = (512, 512, 300), (0.75, 0.75, 1.0)
        path = work / "v.nii"
        apart(lambda: make_trunk(path, size, spacing))
        _, axes, _ = TRUNK[-1]
        yield {"case": "like a CT, 512 x 512 x 300 of int16, an ellipsoid of 17 ml", "n": 512,
               "path": path, "seed": ",".join(map(str, TRUNK[-1][0])), "distance": trunk_distance,
               "volume": 4 / 3 * math.pi * np.prod(axes), "voxel": np.prod(spacing) ** (1 / 3),
               "phantom": False}


def table(rows, skipped):
    lines = ["| case | N | program | wall s | CPU s | CPU, times the first row's | peak MB | mean, 95 % voxel | volume % | triangles |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    reference = {}
    for r in rows:
        head = f"| {r['case']} | {r['n']} | {r['program']} |"
        if "failure" in r:
            lines.append(f"{head} {r['failure']} | | | | | | |")
            continue
        first = reference.setdefault((r["case"], r["n"]), r["cpu_s"])
        low, high = r["wall_range_s"]
        spread = f" ({low:.2f} to {high:.2f})" if r["runs"] > 1 else " (one run)"
        lines.append(f"{head} {r['wall_s']:.2f}{spread} | {r['cpu_s']:.2f} | {r['cpu_s'] / max(first, 1e-3):.1f} "
                     f"| {r['peak_mb']:.0f} | {r['mean_voxel']:.3f}, {r['p95_voxel']:.3f} "
                     f"| {r['volume_percent']:+.2f} | {r['triangles']} |")
    for name in skipped:
        lines.append(f"\nSkipped, not installed: {name}.")
    return "\n".join(lines)


def plot(rows, case):
    """CPU seconds against N of one case, both logarithmic, as SVG; None if no program has come to an end."""
    rows = [dict(r, cpu_s=max(r["cpu_s"], 1e-3)) for r in rows if r["case"] == case and "cpu_s" in r]
    if not rows:
        return None
    low = math.floor(math.log10(min(r["cpu_s"] for r in rows)))
    high = max(low + 1, math.ceil(math.log10(max(r["cpu_s"] for r in rows))))
    curves = {}
    for r in rows:
        curves.setdefault(r["program"], []).append((r["n"], r["cpu_s"]))
    return line_plot(curves, f"N, {case} in N^3 voxels: CPU seconds after reading",
                     [(n, str(n)) for n in sorted({r["n"] for r in rows})],
                     [(10.0**power, f"{10.0**power:g} s") for power in range(low, high + 1)], math.log10)


def page_of(path):
    """Its text, if a table can be put into it."""
    try:
        page = path.read_text()
    except OSError as error:
        raise SystemExit(f"bench.py: {path}: {error.strerror}") from None
    if not re.search(f"{BEGIN}.*{END}", page, re.S):
        raise SystemExit(f"bench.py: {path}: has no {BEGIN} ... {END} to put the table between")
    return page


def write_document(path, text):
    page = page_of(path)
    path.write_text(re.sub(f"{BEGIN}.*{END}", lambda _: f"{BEGIN}\n{text}\n{END}", page, flags=re.S))


def main():
    parser = argparse.ArgumentParser(prog="bench.sh", description=__doc__.split("\n\n")[1],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="64,128,256", help="N of phantoms in N^3 voxels [%(default)s]")
    parser.add_argument("--runs", type=int, default=3, help="of each; one where they take over a minute [%(default)s]")
    parser.add_argument("--limit", type=float, default=600, help="seconds for one run [%(default)s]")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/performance.md",
                        help=f"page whose part between {BEGIN} and {END} is replaced, with a plot beside it; - prints the table alone")
    parser.add_argument("--json", type=pathlib.Path, help="the numbers")
    parser.add_argument("--light", action="store_true", help="two small phantoms, no peers: only proves that it runs")
    parser.add_argument("--surfseg", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--peers", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    a = parser.parse_args()
    try:
        a.sizes = [32] if a.light else [int(n) for n in a.sizes.split(",")]
    except ValueError:
        parser.error(f"--sizes: expected numbers such as 64,128; got '{a.sizes}'")
    if min(a.sizes) < 16 or a.runs < 1:
        parser.error("--sizes: at least 16; --runs: at least 1")
    if a.light:
        a.runs, a.output = 1, "-"
    if str(a.output) != "-":
        page_of(a.output)  # before hours of work
    programs = [Surfseg("surfseg, its seed alone", a.surfseg, []),
                Surfseg("surfseg, minimal-surface", a.surfseg,
                        ["--energy", "minimal-surface", "--radius", "0.15mm"])]
    peers = [] if a.light else [
        Itk(a.peers),
        PythonPeer("scikit-image, morphological geodesic", "morphological-gac", "skimage"),
        PythonPeer("scikit-image, morphological Chan-Vese", "morphological-chan-vese", "skimage"),
        PythonPeer("scikit-image, random walker (told the outside)", "random-walker", "skimage", 64),
        PythonPeer("VTK, flying edges (told the value)", "flying-edges", "vtk"),
        PythonPeer("VTK, the same and windowed sinc", "windowed-sinc", "vtk"),
        Cgal(a.peers)]
    skipped = [peer.name for peer in peers if not peer.is_there()]
    for name in skipped:
        print(f"skipped, not installed: {name}", file=sys.stderr)
    rows, seconds_a_voxel = [], {}
    with tempfile.TemporaryDirectory(prefix="surfseg-bench.") as folder:
        work = pathlib.Path(folder)
        for scene in scenes(a, work):
            fitting = programs + [p for p in peers if p.name not in skipped]
            for program in fitting if scene["phantom"] else programs[:1]:
                row = {"case": scene["case"], "n": scene["n"], "program": program.name}
                expected = seconds_a_voxel.get((scene["case"], program.name), 0) * scene["n"]**3
                try:
                    if program in peers and expected > a.limit:
                        row["failure"] = f"not begun: {expected:.0f} s by the size before"
                    else:
                        row.update(measure(program, scene, a, work))
                        seconds_a_voxel[scene["case"], program.name] = row["wall_s"] / scene["n"]**3
                except TooSlow:
                    if isinstance(program, PythonPeer) and scene["n"] > program.largest:
                        continue
                    row["failure"] = f"over {a.limit:g} s"
                except subprocess.CalledProcessError as error:
                    row["failure"] = f"exit code {error.returncode}"
                    print(error.stderr.decode(errors="replace"), file=sys.stderr)
                rows.append(row)
                print(table([row], []).split("\n")[-1], file=sys.stderr)
    if a.json:
        a.json.write_text(json.dumps(rows, indent=1))
    text = table(rows, skipped)
    if str(a.output) == "-":
        print(text)
    else:
        drawing = plot(rows, "noisy ball" if len(a.sizes) > 1 else rows[0]["case"])
        if drawing:
            picture = a.output.parent / "pictures" / "bench-time.svg"
            picture.parent.mkdir(exist_ok=True)
            picture.write_text(drawing)
            text += f"\n\n![CPU seconds against N](pictures/{picture.name})"
        write_document(a.output, text)
    return 1 if any("failure" in r and r["program"].startswith("surfseg") for r in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
