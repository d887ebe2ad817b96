"""What was found: surfaces in volumes, curves in images."""

from __future__ import annotations

import json
import os
from typing import Any, Optional, Union

import numpy as np

from . import _surfseg
from ._surfseg import Image, Volume
from .images import from_ras, pixel


class _Shape:
    """What surfaces and curves have in common."""

    def __init__(self, shape: Any):
        self._shape = shape
        self._report: Optional[dict] = None

    @property
    def outcome(self) -> str:
        """"converged", "stopped at a limit", "interrupted", "proposed"."""
        return self._shape.outcome

    @property
    def report(self) -> dict:
        """What --json of `surfseg segment` or `curveseg segment` says of the segmentation:
        docs/file-formats.md, docs/python.md."""
        if self._report is None:
            self._report = json.loads(self._shape.summary())
        return self._report

    @property
    def verdict(self) -> Optional[dict]:
        """How far to trust it: {"trust": "trusted" | "check" | "doubtful", ...}; None if unknown."""
        return self.report.get("verdict")


class Surface(_Shape):
    """A verified surface: closed, manifold, outward, without self-intersections."""

    def __init__(self, surface: _surfseg.Surface, volume: Volume):
        super().__init__(surface)
        self._volume = volume

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) float64, RAS mm; read-only, shares the library's memory."""
        return self._shape.vertices

    @property
    def faces(self) -> np.ndarray:
        """(m, 3) int32, counter-clockwise seen from outside; read-only, shared."""
        return self._shape.faces

    @property
    def deviation_mm(self) -> Optional[np.ndarray]:
        """(n,) float64: standard deviation of each vertex' distance to the edge; None if unknown."""
        return self._shape.deviation_mm

    @property
    def edge_strength(self) -> Optional[np.ndarray]:
        """(n,) float64: height of the step by the noise; None if unknown."""
        return self._shape.edge_strength

    @property
    def curvature(self) -> np.ndarray:
        """(n,) float64, 1/mm: the sum of the principal curvatures at each vertex, 2 / r on a ball."""
        return self._shape.curvature()

    @property
    def volume_ml(self) -> float:
        return self._shape.volume_mm3 / 1000

    @property
    def area_cm2(self) -> float:
        return self._shape.area_mm2 / 100

    def vertices_in(self, space: str) -> np.ndarray:
        """The vertices in "ras" or "lps" mm, or as voxel indices "ijk"."""
        return from_ras(self.vertices, space, self._volume.affine)

    def mask(self) -> np.ndarray:
        """1 where a voxel's centre is inside, else 0: uint8, indexed [i, j, k] as the image."""
        return self._shape.mask()

    def nifti(self):
        """The mask as a nibabel image on the volume's grid."""
        import nibabel

        out = nibabel.Nifti1Image(self.mask(), self._volume.affine)
        out.header.set_xyzt_units("mm")
        return out

    def save(self, path: Union[str, os.PathLike], space: str = "lps") -> None:
        """Writes .stl, .obj, .ply, .vtp, .gii, .glb, .3mf or .dcm (DICOM Encapsulated STL), or the
        mask as .nii.gz, .nii, .mha, .nrrd, .seg.nrrd or .seg.dcm (DICOM Segmentation): the bytes
        that the program writes.

        space: frame of a surface's coordinates, "lps" (as Slicer expects) or "ras".
        Raises OutputError where the file cannot be written; it is whole or not there. DICOM needs
        a volume that was read from a DICOM series, else InputError.
        """
        self._shape.save(os.fspath(path), space)

    def scores(self, reference: Union[str, os.PathLike], label: Optional[int] = None) -> dict:
        """See evaluate()."""
        return json.loads(self._shape.scores(os.fspath(reference), label))

    def __repr__(self) -> str:
        return (f"<surfseg.Surface: {len(self.faces)} triangles, {self.volume_ml:.5g} ml, "
                f"{self.area_cm2:.5g} cm2, {self.outcome}>")


class Curve(_Shape):
    """Verified curves in an image: closed polygons without intersections, the object on their left."""

    def __init__(self, curve: _surfseg.Curve, image: Image):
        super().__init__(curve)
        self._image = image

    @property
    def points(self) -> np.ndarray:
        """(n, 2) float64: x, y in mm, the centre of the first pixel at 0, 0; read-only, shared."""
        return self._shape.points

    @property
    def segments(self) -> np.ndarray:
        """(n, 2) int32: start and end of each, as numbers of points; read-only, shared."""
        return self._shape.segments

    @property
    def polygons(self) -> list[np.ndarray]:
        """Each closed curve as (k, 2) points in mm, the first not repeated. The sum of
        x_i y_(i+1) - x_(i+1) y_i is positive for an outer curve, negative for a hole's."""
        following = dict(self.segments.tolist())
        out = []
        while following:
            first, point = next(iter(following.items()))
            ring = [first]
            del following[first]
            while point != first:
                ring.append(point)
                point = following.pop(point)
            out.append(self.points[ring])
        return out

    @property
    def area_mm2(self) -> float:
        return self._shape.area_mm2

    @property
    def length_mm(self) -> float:
        return self._shape.length_mm

    def points_in(self, space: str) -> np.ndarray:
        """The points in "mm" or "px"."""
        return self.points / pixel(space, self._image)

    def mask(self) -> np.ndarray:
        """1 where a pixel's centre is inside, else 0: uint8, indexed [row, column]."""
        return self._shape.mask()

    def save(self, path: Union[str, os.PathLike]) -> None:
        """Writes .svg, .json, .vtp or .csv, or the mask as .png: the bytes that curveseg writes."""
        self._shape.save(os.fspath(path))

    def __repr__(self) -> str:
        return (f"<surfseg.Curve: {len(self.polygons)} polygons, {self.area_mm2:.5g} mm2, "
                f"{self.length_mm:.5g} mm, {self.outcome}>")
