"""Peers with a Python interface, for tools/bench.sh:

  python_peers.py METHOD VOLUME.nii X,Y,Z SURFACE.npz

METHOD: flying-edges (VTK's isosurface at 0.5, which it is told), windowed-sinc (the same, smoothed),
morphological-gac, morphological-chan-vese, random-walker (scikit-image, from a ball of radius 0.15
round the point, which is inside; the last two told nothing else, the first balloons). Prints {"wall_s", "cpu_s"} from the
array in memory to the mask or mesh.
"""
import json
import resource
import sys
import time

import numpy as np

START_RADIUS = 0.15


def read(path):
    """Values [k, j, i], spacing and origin of an uncompressed NIfTI-1 of floats."""
    raw = open(path, "rb").read()
    size = np.frombuffer(raw, "<i2", 3, 42)
    spacing = float(np.frombuffer(raw, "<f4", 1, 80)[0])
    origin = float(np.frombuffer(raw, "<f4", 1, 292)[0])
    offset = int(np.frombuffer(raw, "<f4", 1, 108)[0])
    return np.frombuffer(raw, "<f4", offset=offset).reshape(size[::-1]), spacing, origin


def start_ball(values, spacing, origin, seed):
    axes = [origin + spacing * np.arange(n) - s for n, s in zip(values.shape, seed[::-1])]
    z, y, x = np.meshgrid(*axes, indexing="ij", sparse=True)
    return x * x + y * y + z * z < START_RADIUS**2


def flying_edges(values, spacing, origin, is_smoothed):
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    image = vtk.vtkImageData()
    image.SetDimensions(*values.shape[::-1])
    image.SetSpacing(spacing, spacing, spacing)
    image.SetOrigin(origin, origin, origin)
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel()))
    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.5)
    last = edges
    if is_smoothed:
        last = vtk.vtkWindowedSincPolyDataFilter()
        last.SetInputConnection(edges.GetOutputPort())
        last.SetNumberOfIterations(20)
        last.SetPassBand(0.1)
    last.Update()
    mesh = last.GetOutput()
    polygons = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(mesh.GetPoints().GetData()).copy(), polygons.copy()


def run(method, values, spacing, origin, seed):
    if method in ("flying-edges", "windowed-sinc"):
        return {"mesh": flying_edges(values, spacing, origin, method == "windowed-sinc")}
    from skimage import segmentation

    start = start_ball(values, spacing, origin, seed)
    if method == "morphological-gac":
        steepness = segmentation.inverse_gaussian_gradient(values, alpha=1000, sigma=2)
        mask = segmentation.morphological_geodesic_active_contour(
            steepness, values.shape[0], init_level_set=start, smoothing=1, balloon=1)
        return {"mask": mask}
    if method == "morphological-chan-vese":
        return {"mask": segmentation.morphological_chan_vese(values, values.shape[0] // 2,
                                                             init_level_set=start, smoothing=1)}
    if method == "random-walker":
        labels = np.zeros(values.shape, np.int32)
        labels[start] = 1
        labels[[0, -1]] = 2
        labels[:, [0, -1]] = 2
        labels[:, :, [0, -1]] = 2
        return {"mask": segmentation.random_walker(values, labels, beta=130, mode="cg_j") == 1}
    raise SystemExit(f"python_peers.py: {method} is not a method")


def main():
    method, volume, seed, output = sys.argv[1:]
    values, spacing, origin = read(volume)
    if method not in ("flying-edges", "windowed-sinc"):
        from skimage import segmentation  # noqa: F401, not part of the time
    else:
        import vtk  # noqa: F401
    wall, usage = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    result = run(method, values, spacing, origin, [float(x) for x in seed.split(",")])
    now = resource.getrusage(resource.RUSAGE_SELF)
    print(json.dumps({"wall_s": time.perf_counter() - wall,
                      "cpu_s": now.ru_utime + now.ru_stime - usage.ru_utime - usage.ru_stime}))
    if "mesh" in result:
        np.savez(output, points=result["mesh"][0], triangles=result["mesh"][1])
    else:
        np.savez(output, mask=np.asarray(result["mask"], np.float32))


main()
