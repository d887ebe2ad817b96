"""Contours of a surface in the slices of its scan: closed polygons in voxel coordinates.

    slices.py                                 # a phantom
    slices.py ct.nii.gz 86,122,343 slice.png  # and a picture of the middle slice (Matplotlib)
"""

import sys

import numpy as np
import surfseg


def contours(vertices, faces, axis, at):
    """Where the plane index[axis] = at cuts the triangles: a list of (n, 2) closed polygons of the
    other two indices. Planes through vertices are moved by a millionth of a voxel."""
    side = vertices[:, axis] - at
    side[side == 0] = 1e-6
    others = [k for k in range(3) if k != axis]
    following, place = {}, {}
    for triangle in faces[np.ptp((side[faces] > 0).astype(int), axis=1) > 0]:
        ends = {}
        for a, b in zip(triangle, np.roll(triangle, -1)):
            if (side[a] > 0) == (side[b] > 0):
                continue
            edge = (min(a, b), max(a, b))
            lower, upper = edge
            share = side[lower] / (side[lower] - side[upper])
            place[edge] = (vertices[lower] + share * (vertices[upper] - vertices[lower]))[others]
            ends["out" if side[a] > 0 else "in"] = edge
        following[ends["out"]] = ends["in"]
    out = []
    while following:
        first, edge = next(iter(following.items()))
        polygon = [place[first]]
        del following[first]
        while edge != first:
            polygon.append(place[edge])
            edge = following.pop(edge)
        out.append(np.array(polygon))
    return out


def area(polygon):
    x, y = polygon.T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def main(arguments):
    volume = surfseg.read(arguments[0]) if arguments else surfseg.phantom("torus", size=48)
    seed = [float(x) for x in arguments[1].split(",")] if arguments else (0.5, 0, 0)
    surface = surfseg.segment(volume, [seed])
    vertices = surface.vertices_in("ijk").copy()
    low, high = np.ceil(vertices[:, 2].min()), np.floor(vertices[:, 2].max())
    slices = {int(k): contours(vertices, surface.faces, 2, k) for k in np.arange(low, high + 1)}
    for k, polygons in slices.items():
        print(f"slice {k}: {len(polygons)} contours, {abs(sum(map(area, polygons))):.1f} pixels")
    middle = int((low + high) / 2)
    # The slices' areas add up to the volume, but for what lies between the outermost slices and the
    # ends: 1 to 2 % of a tube that is 19 slices high.
    total = abs(sum(area(p) for polygons in slices.values() for p in polygons))
    voxel_mm3 = abs(np.linalg.det(volume.affine[:3, :3]))
    print(f"{total * voxel_mm3 / 1000:.5g} ml by slices, {surface.volume_ml:.5g} ml by the surface")
    if len(arguments) > 2:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

        pyplot.imshow(volume.array()[:, :, middle].T, cmap="gray", origin="lower")
        for polygon in slices[middle]:
            pyplot.plot(*np.vstack([polygon, polygon[:1]]).T, "y-", linewidth=1)
        pyplot.savefig(arguments[2], dpi=150)
    if not arguments:
        assert len(slices[middle]) == 2, "a ring has an outer and an inner contour"
        assert abs(total * voxel_mm3 / 1000 / surface.volume_ml - 1) < 0.03


if __name__ == "__main__":
    main(sys.argv[1:])
