"""Surfaces from CT and MRI volumes: closed, manifold, sub-voxel; and curves from images.

Arrays are indexed [i, j, k]; an affine is the (4, 4) matrix from voxel index to RAS mm (as nibabel
has it); points are RAS mm unless `space` says otherwise; lengths are mm. Images are indexed
[row, column]; points in them are (x, y) in pixels unless `space` says mm.

    import surfseg
    liver = surfseg.segment("ct.nii.gz", seeds=[(95, 182, 373)])
    print(liver.volume_ml, liver.verdict)
    liver.save("liver.stl")
"""

from __future__ import annotations

import json
import os
from typing import Any, Callable, Iterable, NamedTuple, Optional, Sequence, Union

import numpy as np

from . import _surfseg
from ._surfseg import (Error, Image, InputError, InvalidMesh, NoObject, OutputError, UsageError,
                       Volume, __version__)

__all__ = [
    "Curve", "Error", "Image", "InputError", "InvalidMesh", "NoObject", "OutputError", "Progress",
    "Segmentation", "Surface", "UsageError", "Volume", "evaluate", "phantom", "read", "segment",
]

Point = Sequence[float]
# Options of `surfseg segment` that are lengths: a number is mm.
_LENGTHS = {"radius", "sigma", "selective_sigma", "edge_length", "geometry_tolerance",
            "topology_resolution", "sheet_distance"}


class Progress(NamedTuple):
    """Where the work is, after a step, or in one that takes long."""

    stage: str         #: "begin", "propose", "evolve", "locate", ...
    step: int          #: of the stage
    triangles: int     #: of the surface, or segments of the curve; 0 while there is none
    volume_mm3: float  #: that it encloses; of a curve the area in mm2
    energy: float      #: of this moment
    seconds: float     #: since the call


ProgressFunction = Callable[[Progress], Optional[bool]]


class Surface:
    """A verified surface: closed, manifold, outward, without self-intersections."""

    def __init__(self, surface: _surfseg.Surface, volume: Volume):
        self._surface = surface
        self._volume = volume
        self._report: Optional[dict] = None

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) float64, RAS mm; read-only, shares the library's memory."""
        return self._surface.vertices

    @property
    def faces(self) -> np.ndarray:
        """(m, 3) int32, counter-clockwise seen from outside; read-only, shared."""
        return self._surface.faces

    @property
    def deviation_mm(self) -> Optional[np.ndarray]:
        """(n,) float64: standard deviation of each vertex' distance to the edge; None if unknown."""
        return self._surface.deviation_mm

    @property
    def edge_strength(self) -> Optional[np.ndarray]:
        """(n,) float64: height of the step by the noise; None if unknown."""
        return self._surface.edge_strength

    @property
    def curvature(self) -> np.ndarray:
        """(n,) float64, 1/mm: the sum of the principal curvatures at each vertex, 2 / r on a ball."""
        return self._surface.curvature()

    @property
    def outcome(self) -> str:
        """"converged", "stopped at a limit", "interrupted", "proposed"."""
        return self._surface.outcome

    @property
    def volume_ml(self) -> float:
        return self._surface.volume_mm3 / 1000

    @property
    def area_cm2(self) -> float:
        return self._surface.area_mm2 / 100

    @property
    def report(self) -> dict:
        """What `surfseg segment --json` says of the run: docs/file-formats.md."""
        if self._report is None:
            self._report = json.loads(self._surface.summary())
        return self._report

    @property
    def verdict(self) -> Optional[dict]:
        """How far to trust it: {"trust": "trusted" | "check" | "doubtful", ...}; None if unknown."""
        return self.report.get("verdict")

    def vertices_in(self, space: str) -> np.ndarray:
        """The vertices in "ras" or "lps" mm, or as voxel indices "ijk"."""
        return _from_ras(self.vertices, space, self._volume.affine)

    def mask(self) -> np.ndarray:
        """1 where a voxel's centre is inside, else 0: uint8, indexed [i, j, k] as the image."""
        return self._surface.mask()

    def nifti(self):
        """The mask as a nibabel image on the volume's grid."""
        import nibabel

        return nibabel.Nifti1Image(self.mask(), self._volume.affine)

    def save(self, path: Union[str, os.PathLike], space: str = "lps") -> None:
        """Writes .stl, .obj, .ply, .vtp, .gii, .glb, .3mf or .dcm (DICOM Encapsulated STL), or the
        mask as .nii.gz, .nii, .mha, .nrrd, .seg.nrrd or .seg.dcm (DICOM Segmentation): the bytes
        that the program writes.

        space: frame of a surface's coordinates, "lps" (as Slicer expects) or "ras".
        Raises OutputError where the file cannot be written; it is whole or not there. DICOM needs
        a volume that was read from a DICOM series, else InputError.
        """
        self._surface.save(os.fspath(path), space)

    def __repr__(self) -> str:
        return (f"<surfseg.Surface: {len(self.faces)} triangles, {self.volume_ml:.5g} ml, "
                f"{self.area_cm2:.5g} cm2, {self.outcome}>")


class Curve:
    """Verified curves in an image: closed polygons without intersections, the object on their left."""

    def __init__(self, curve: _surfseg.Curve, image: Image):
        self._curve = curve
        self._image = image
        self._report: Optional[dict] = None

    @property
    def points(self) -> np.ndarray:
        """(n, 2) float64: x, y in mm, the centre of the first pixel at 0, 0; read-only, shared."""
        return self._curve.points

    @property
    def segments(self) -> np.ndarray:
        """(n, 2) int32: start and end of each, as numbers of points; read-only, shared."""
        return self._curve.segments

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
    def outcome(self) -> str:
        """"converged", "stopped at a limit", "interrupted", "proposed"."""
        return self._curve.outcome

    @property
    def area_mm2(self) -> float:
        return self._curve.area_mm2

    @property
    def length_mm(self) -> float:
        return self._curve.length_mm

    @property
    def report(self) -> dict:
        """What `curveseg segment --json` says of the run."""
        if self._report is None:
            self._report = json.loads(self._curve.summary())
        return self._report

    @property
    def verdict(self) -> Optional[dict]:
        """How far to trust it; None if unknown."""
        return self.report.get("verdict")

    def points_in(self, space: str) -> np.ndarray:
        """The points in "mm" or "px"."""
        return self.points / _pixel(space, self._image)

    def mask(self) -> np.ndarray:
        """1 where a pixel's centre is inside, else 0: uint8, indexed [row, column]."""
        return self._curve.mask()

    def save(self, path: Union[str, os.PathLike]) -> None:
        """Writes .svg, .json, .vtp or .csv, or the mask as .png: the bytes that curveseg writes."""
        self._curve.save(os.fspath(path))

    def __repr__(self) -> str:
        return (f"<surfseg.Curve: {len(self.polygons)} polygons, {self.area_mm2:.5g} mm2, "
                f"{self.length_mm:.5g} mm, {self.outcome}>")


Shape = Union[Surface, Curve]


class Segmentation:
    """A dialogue about one volume or image: objects, clicks, proposals, undo.

    What is computed from the volume is kept, so that a further click costs less than the first.
    Several threads may call it: they take turns.
    """

    def __init__(self, image: Any, affine: Optional[np.ndarray] = None, *,
                 spacing: Union[float, Sequence[float], None] = None):
        """image, affine, spacing: as of segment()."""
        self._image = as_image(image, affine, spacing)
        self._is_flat = isinstance(self._image, Image)
        kind = _surfseg.ImageSegmentation if self._is_flat else _surfseg.Segmentation
        self._segmentation = kind(self._image)

    @property
    def volume(self) -> Union[Volume, Image]:
        """What is segmented."""
        return self._image

    @property
    def dimension(self) -> int:
        """3 of a volume, 2 of an image."""
        return 2 if self._is_flat else 3

    @property
    def objects(self) -> list[str]:
        """Their names, in the order in which they were added."""
        return [name for _, name in self._segmentation.objects()]

    def add(self, point: Point, inside: bool = True, *, object: Optional[str] = None,
            space: Optional[str] = None, progress: Optional[ProgressFunction] = None) -> Shape:
        """A click, and the surface that obeys it and those before. See evolve()."""
        self.click(point, inside, object=object, space=space)
        return self.evolve(object=object, progress=progress)

    def click(self, point: Point, inside: bool = True, *, object: Optional[str] = None,
              space: Optional[str] = None) -> None:
        """A click without computing. Raises UsageError for a point outside the volume, or in the
        voxel of a click of the other side."""
        at = self._at([point], "point", space)[0]
        self._segmentation.add_click(self._id(object, True), at, inside)

    def take_back_click(self, index: int, *, object: Optional[str] = None) -> None:
        """index: of clicks(), from 0."""
        self._segmentation.take_back_click(self._id(object), index)

    def clicks(self, *, object: Optional[str] = None) -> list[tuple[tuple[float, ...], bool]]:
        """[((x, y, z) in RAS mm or (x, y) in mm, inside), ...]"""
        return [(tuple(p), side) for p, side in self._segmentation.clicks(self._id(object))]

    def set_options(self, *, object: Optional[str] = None,
                    box: Optional[Sequence[Point]] = None, space: Optional[str] = None,
                    **options: Any) -> None:
        """Options of `surfseg segment`, of `curveseg segment` for an image, with _ for -: edge_length=2 (mm), energy="chan-vese",
        preset="kidney-ct", fill_cavities=True, ...; box: two opposite corners."""
        corners = None
        if box is not None:
            corners = self._at(box, "box", space)
        self._segmentation.set_options(self._id(object, True), _words(options), corners)

    def propose(self, *, object: Optional[str] = None,
                progress: Optional[ProgressFunction] = None) -> list[str]:
        """What the clicks may mean, best first: a line of words for each."""
        return self._segmentation.propose(self._id(object), _told(progress))

    def choose(self, proposal: int, *, object: Optional[str] = None) -> None:
        """The next evolve() starts from this one of propose(), from 0."""
        self._segmentation.choose(self._id(object), proposal)

    def evolve(self, *, object: Optional[str] = None,
               progress: Optional[ProgressFunction] = None) -> Shape:
        """The surface at the minimum of its energy, from where it is.

        progress: called on this thread with a Progress, after steps at most 20 times a second, in
        a step that takes long ten times; False stops with the surface so far. What it raises, and
        Ctrl-C, pass through; the surface so far is that of surface() then.
        Raises NoObject where no object stands out round the clicks.
        """
        self._segmentation.evolve(self._id(object), _told(progress))
        return self.surface(object=object)

    def surface(self, *, object: Optional[str] = None) -> Shape:
        """The present one, in an image a Curve. Raises NoObject if there is none."""
        shape = self._segmentation.shape(self._id(object))
        return Curve(shape, self._image) if self._is_flat else Surface(shape, self._image)

    def undo(self, *, object: Optional[str] = None) -> bool:
        """Takes back the last thing that was done; False if there is none."""
        return self._segmentation.undo(self._id(object))

    def redo(self, *, object: Optional[str] = None) -> bool:
        return self._segmentation.redo(self._id(object))

    def recipe(self) -> str:
        """JSON text that repeats all of it, to the byte: `surfseg replay`, `curveseg replay`,
        replay()."""
        return self._segmentation.recipe(self._image.name)

    def replay(self, recipe: str, progress: Optional[ProgressFunction] = None) -> None:
        """Does what a recipe says. Raises InputError if it is broken or of another volume."""
        self._segmentation.replay(recipe, _told(progress))

    def _at(self, points: Any, what: str, space: Optional[str]) -> np.ndarray:
        """Points of the image or volume in mm."""
        at = _points(points, what, self.dimension)
        if self._is_flat:
            return at * _pixel(space or "px", self._image)
        return _to_ras(at, space or "ras", self._image.affine)

    def _id(self, name: Optional[str], may_add: bool = False) -> int:
        objects = self._segmentation.objects()
        if name is None and len(objects) == 1:
            return objects[0][0]
        for identifier, known in objects:
            if known == name:
                return identifier
        if may_add and (name is not None or not objects):
            return self._segmentation.add_object(name or "")
        if name is None and objects:
            raise UsageError("object: there are several: " + ", ".join(n for _, n in objects))
        raise UsageError(f"object: there is no '{name}'" if name else "object: there is none yet")


def segment(image: Any, seeds: Iterable[Point], affine: Optional[np.ndarray] = None, *,
            outside: Iterable[Point] = (), box: Optional[Sequence[Point]] = None,
            space: Optional[str] = None, spacing: Union[float, Sequence[float], None] = None,
            progress: Optional[ProgressFunction] = None, threads: int = 0,
            **options: Any) -> Shape:
    """The surface of the object with these points in it; in an image a Curve.

    image:    a path (NIfTI, MetaImage, NRRD, VTI, OpenVDB, a DICOM folder), a nibabel image, a
              SimpleITK image, a Volume, or an array indexed [i, j, k] with affine=; or an image: a
              path (PNG, JPEG, TIFF), an Image, or an array indexed [row, column]
    seeds:    points inside the object, each (x, y, z), in an image (x, y)
    outside:  points that do not belong to it
    box:      two opposite corners of a box round it, a centimetre or two larger than it
    space:    of all points: "ras" (if not given) or "lps" mm, or voxel indices "ijk"; in an image
              "px" (if not given), column and row, or "mm"
    spacing:  size of an image's pixels [mm], or (along x, along y); else what the file states, or 1
    progress: as of Segmentation.evolve()
    threads:  at most so many; 0 = all
    options:  those of `surfseg segment`, with _ for -; numbers of lengths are mm

    Raises UsageError, InputError, NoObject, InvalidMesh.
    """
    limit = _surfseg.ThreadLimit(threads) if threads else None
    try:
        dialogue = Segmentation(image, affine, spacing=spacing)
        if options or box is not None:
            dialogue.set_options(box=box, space=space, **options)
        for point in _points(seeds, "seeds", dialogue.dimension):
            dialogue.click(point, True, space=space)
        for point in _points(outside, "outside", dialogue.dimension):
            dialogue.click(point, False, space=space)
        return dialogue.evolve(progress=progress)
    finally:
        del limit


def evaluate(surface: Surface, reference: Union[str, os.PathLike],
             label: Optional[int] = None) -> dict:
    """Dice, volumes, distances [mm] and quality against a mesh's or a label map's file: what
    `surfseg evaluate --json` writes."""
    if not isinstance(surface, Surface):
        raise UsageError("surface: expected a Surface; `curveseg evaluate` compares curves")
    return json.loads(surface._surface.scores(os.fspath(reference), label))


def read(path: Union[str, os.PathLike], frame: int = 0,
         series_uid: Optional[str] = None) -> Volume:
    """A volume from a file or a DICOM folder. Raises InputError."""
    return _surfseg.read(os.fspath(path), frame, series_uid)


def phantom(kind: str, size: Union[int, Sequence[int]] = 128, noise: float = 0,
            random_seed: int = 0) -> Volume:
    """A test volume whose surface is known exactly: `surfseg phantom --help`."""
    sizes = [size] * 3 if np.ndim(size) == 0 else list(size)
    return _surfseg.phantom(kind, [int(n) for n in sizes], noise, random_seed)


def as_volume(image: Any, affine: Optional[np.ndarray] = None) -> Volume:
    """What segment() takes as an image."""
    if isinstance(image, Volume):
        return image
    if isinstance(image, (str, os.PathLike)):
        return read(image)
    if hasattr(image, "GetDirection") and hasattr(image, "GetOrigin"):
        return _from_simple_itk(image)
    if hasattr(image, "affine") and hasattr(image, "dataobj"):
        name = image.get_filename() if hasattr(image, "get_filename") else None
        return _surfseg.Volume(np.asanyarray(image.dataobj), image.affine, name or "")
    if affine is None:
        raise UsageError("affine: an array needs the 4 x 4 matrix from voxel index to RAS mm")
    return _surfseg.Volume(np.asanyarray(image), np.asarray(affine), "")


def as_image(image: Any, affine: Optional[np.ndarray] = None,
             spacing: Union[float, Sequence[float], None] = None) -> Union[Volume, Image]:
    """What segment() takes: a volume, or an image of two dimensions."""
    if isinstance(image, Image):
        return image
    is_file = isinstance(image, (str, os.PathLike))
    is_picture = is_file and _surfseg.is_image_file(os.fspath(image))
    is_flat = isinstance(image, np.ndarray) and image.ndim == 2 and affine is None
    if not (is_picture or is_flat):
        if spacing is not None:
            raise UsageError("spacing: belongs to an image; a volume has its affine")
        return as_volume(image, affine)
    sizes = None if spacing is None else _spacing(spacing)
    if is_picture:
        return Image.read(os.fspath(image), sizes)
    return Image(image, sizes or [1.0, 1.0], "")


def _spacing(spacing: Union[float, Sequence[float]]) -> list[float]:
    try:
        sizes = np.broadcast_to(np.asarray(spacing, dtype=float), 2)
    except (TypeError, ValueError):
        raise UsageError(f"spacing: expected one or two lengths [mm]; got {spacing!r}") from None
    return [float(size) for size in sizes]


def _from_simple_itk(image: Any) -> Volume:
    """Index order [z, y, x] and LPS become [i, j, k] and RAS."""
    if hasattr(image, "__array__"):
        values = np.asarray(image)
    else:
        import SimpleITK

        values = SimpleITK.GetArrayViewFromImage(image)
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * np.asarray(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return _surfseg.Volume(values.T, np.diag([-1, -1, 1, 1]) @ affine, "")


def _points(points: Any, what: str, n: int) -> np.ndarray:
    words = "three numbers (x, y, z)" if n == 3 else "two numbers (x, y)"
    try:
        out = np.asarray(list(points), dtype=float)
    except (TypeError, ValueError):
        raise UsageError(f"{what}: expected points of {words}") from None
    if out.size == 0:
        return out.reshape(0, n)
    if out.shape == (n,):
        out = out.reshape(1, n)
    if out.ndim != 2 or out.shape[1] != n:
        raise UsageError(f"{what}: expected points of {words}; got an array of shape {out.shape}")
    return out


def _pixel(space: str, image: Image) -> np.ndarray:
    """Size of the unit of a space in an image [mm]."""
    if space not in ("px", "mm"):
        raise UsageError(f"space: expected 'px' or 'mm' in an image; got '{space}'")
    return np.array(image.spacing_mm if space == "px" else (1.0, 1.0))


def _to_ras(points: np.ndarray, space: str, affine: np.ndarray) -> np.ndarray:
    if space == "ijk":
        return points @ affine[:3, :3].T + affine[:3, 3]
    return points * _signs(space)


def _from_ras(points: np.ndarray, space: str, affine: np.ndarray) -> np.ndarray:
    if space == "ijk":
        return np.linalg.solve(affine[:3, :3], (points - affine[:3, 3]).T).T
    return points * _signs(space)


def _signs(space: str) -> np.ndarray:
    if space not in ("ras", "lps"):
        raise UsageError(f"space: expected 'ras', 'lps' or 'ijk'; got '{space}'")
    return np.array([1.0, 1.0, 1.0] if space == "ras" else [-1.0, -1.0, 1.0])


def _words(options: dict) -> list[str]:
    """As one would type them."""
    out: list[str] = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        for item in value if isinstance(value, (list, tuple)) else [value]:
            if item is True:
                out.append(option)
                continue
            is_length = name in _LENGTHS and not isinstance(item, str)
            out += [option, f"{item}mm" if is_length else str(item)]
    return out


def _told(progress: Optional[ProgressFunction]):
    if progress is None:
        return None
    return lambda *values: progress(Progress(*values))
