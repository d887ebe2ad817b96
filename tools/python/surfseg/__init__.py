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

import functools
import operator
import os
import threading
from typing import Any, Callable, Iterable, NamedTuple, Optional, Sequence, TypeVar, Union, cast

import numpy as np

from . import _surfseg
from ._surfseg import (Error, Image, InputError, InvalidMesh, NoObject, OutputError, UsageError,
                       Volume, __version__)
from .images import as_image, pixel, points_of, read, to_ras
from .shapes import Curve, Surface

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


Shape = Union[Surface, Curve]


_Act = TypeVar("_Act", bound=Callable[..., Any])


def _in_turn(act: _Act) -> _Act:
    """A method that is one turn, however many calls of the library it makes."""
    @functools.wraps(act)
    def alone(self, *words, **more):
        with self._turn:
            return act(self, *words, **more)
    return cast(_Act, alone)


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
        self._turn = threading.RLock()

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

    @_in_turn
    def add(self, point: Point, inside: bool = True, *, object: Optional[str] = None,
            space: Optional[str] = None, progress: Optional[ProgressFunction] = None) -> Shape:
        """A click, and the surface that obeys it and those before. See evolve(). Where no object
        stands out, or it vanishes, the click is taken back, as is an outside one before the first
        inside click: click() keeps that. So is one of which no surface can be made (InvalidMesh)."""
        known = self._segmentation.objects()
        self.click(point, inside, object=object, space=space)
        try:
            return self.evolve(object=object, progress=progress)
        except (UsageError, NoObject, InvalidMesh) as error:
            is_stopped = (isinstance(error, NoObject)
                          and self._segmentation.outcome(self._id(object)) == "interrupted")
            if not is_stopped:
                self.undo(object=object)
                self._drop_new(known)
            raise

    @_in_turn
    def click(self, point: Point, inside: bool = True, *, object: Optional[str] = None,
              space: Optional[str] = None) -> None:
        """A click without computing. Raises UsageError for a point outside the volume, or in the
        voxel of a click of the other side."""
        at = self._at([point], "point", space)[0]
        if not isinstance(inside, (bool, np.bool_)):
            raise UsageError(f"inside: expected True or False; got {inside!r}")
        known = self._segmentation.objects()
        try:
            self._segmentation.add_click(self._id(object, True), at, bool(inside))
        except UsageError:
            self._drop_new(known)
            raise

    @_in_turn
    def take_back_click(self, index: int, *, object: Optional[str] = None) -> None:
        """index: of clicks(), from 0."""
        self._segmentation.take_back_click(self._id(object), _count(index, "index"))

    def clicks(self, *, object: Optional[str] = None) -> list[tuple[tuple[float, ...], bool]]:
        """[((x, y, z) in RAS mm or (x, y) in mm, inside), ...]"""
        if object is None and not self.objects:
            return []
        return [(tuple(p), side) for p, side in self._segmentation.clicks(self._id(object))]

    @_in_turn
    def set_options(self, *, object: Optional[str] = None,
                    box: Optional[Sequence[Point]] = None, space: Optional[str] = None,
                    **options: Any) -> None:
        """Options of `surfseg segment`, of `curveseg segment` for an image, with _ for -: edge_length=2 (mm), energy="chan-vese",
        preset="kidney-ct", fill_cavities=True, ...; box: two opposite corners."""
        corners = None
        if box is not None:
            corners = self._at(box, "box", space)
        known = self._segmentation.objects()
        try:
            words = _words(options, self._segmentation.options())
            self._segmentation.set_options(self._id(object, True), words, corners,
                                          not self._is_flat and space != "ijk")
        except UsageError:
            self._drop_new(known)
            raise

    @_in_turn
    def propose(self, *, object: Optional[str] = None,
                progress: Optional[ProgressFunction] = None) -> list[str]:
        """What the clicks may mean, best first: a line of words for each. The best takes the place
        of the surface so far, until evolve()."""
        return self._segmentation.propose(self._id(object), _told(progress))

    @_in_turn
    def choose(self, proposal: int, *, object: Optional[str] = None) -> None:
        """The next evolve() starts from this one of propose(), from 0."""
        self._segmentation.choose(self._id(object), _count(proposal, "proposal"))

    @_in_turn
    def evolve(self, *, object: Optional[str] = None, steps: Optional[int] = None,
               progress: Optional[ProgressFunction] = None) -> Shape:
        """The surface at the minimum of its energy, from where it is; without an energy, after other
        options, from the region of the clicks again.

        steps: stops after so many, with outcome "interrupted"; the next call goes on with the same
        energy. Rest is seen within one call: fewer than 8 at a time go on for ever.
        progress: called on this thread with a Progress, after steps at most 20 times a second, in
        a step that takes long ten times; False stops with the surface so far. What it raises, and
        Ctrl-C, pass through; the surface so far is that of surface() then, not before: asked by
        progress itself the segmentation raises UsageError.
        Raises NoObject where no object stands out round the clicks.
        """
        if steps is not None:
            steps = _count(steps, "steps", 1)
        self._segmentation.evolve(self._id(object), steps, _told(progress))
        return self.surface(object=object)

    def surface(self, *, object: Optional[str] = None) -> Shape:
        """The present one, in an image a Curve. Raises NoObject if there is none."""
        shape = self._segmentation.shape(self._id(object))
        return Curve(shape, self._image) if self._is_flat else Surface(shape, self._image)

    @_in_turn
    def undo(self, *, object: Optional[str] = None) -> bool:
        """Takes back the last thing that was done, with the proposals and surfaces that it set off;
        False if there is none."""
        return self._segmentation.undo(self._id(object))

    @_in_turn
    def redo(self, *, object: Optional[str] = None) -> bool:
        """Does again what was undone last, with what it set off; False if there is none."""
        return self._segmentation.redo(self._id(object))

    def recipe(self) -> str:
        """JSON text that repeats all of it, to the byte: `surfseg replay`, `curveseg replay`,
        replay()."""
        return self._segmentation.recipe(self._image.name)

    @_in_turn
    def replay(self, recipe: str, progress: Optional[ProgressFunction] = None) -> None:
        """Does what a recipe says. Raises InputError if it is broken or of another volume."""
        self._segmentation.replay(recipe, _told(progress))

    def _at(self, points: Any, what: str, space: Optional[str]) -> np.ndarray:
        """Points of the image or volume in mm."""
        at = points_of(points, what, self.dimension)
        if self._is_flat:
            return at * pixel(space or "px", self._image)
        return to_ras(at, space or "ras", self._image.affine)

    def _drop_new(self, known: list) -> None:
        """Removes objects that were added since for an act that failed."""
        for one in self._segmentation.objects():
            if one not in known:
                self._segmentation.remove_object(one[0])

    def _id(self, name: Optional[str], may_add: bool = False) -> int:
        if name is not None and not isinstance(name, str):
            raise UsageError(f"object: expected a name; got {name!r}")
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
        raise UsageError(f"object: there is no '{name}'" if name else "object: there is none yet; add a click")


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
    threads = _count(threads or 0, "threads")
    limit = _surfseg.ThreadLimit(threads) if threads else None
    try:
        dialogue = Segmentation(image, affine, spacing=spacing)
        if options or box is not None:
            dialogue.set_options(box=box, space=space, **options)
        inside = points_of(seeds, "seeds", dialogue.dimension)
        if len(inside) == 0:
            raise UsageError("seeds: expected one point at least")
        for point in inside:
            dialogue.click(point, True, space=space)
        for point in points_of(outside, "outside", dialogue.dimension):
            dialogue.click(point, False, space=space)
        return dialogue.evolve(progress=progress)
    finally:
        del limit


def evaluate(surface: Surface, reference: Union[str, os.PathLike],
             label: Optional[int] = None) -> dict:
    """Dice, volumes, distances [mm] and quality against a mesh's or a label map's file: what
    `surfseg evaluate --json` writes."""
    if not isinstance(surface, Surface):
        raise UsageError(f"surface: expected a Surface; got {type(surface).__name__} (files and "
                         "curves are compared by `surfseg evaluate` and `curveseg evaluate`)")
    if not isinstance(reference, (str, os.PathLike)):
        raise UsageError("reference: expected the path of a mesh or a label map; got "
                         f"{type(reference).__name__}")
    if label is not None:
        label = _count(label, "label", least=-(1 << 31))
    return surface.scores(reference, label)


def phantom(kind: str, size: Union[int, Sequence[int]] = 128, noise: float = 0,
            random_seed: int = 0) -> Volume:
    """A test volume whose surface is known exactly: `surfseg phantom --help`."""
    sizes = [size] * 3 if np.ndim(size) == 0 else list(size)
    return _surfseg.phantom(kind, [int(n) for n in sizes], noise, random_seed)


def _count(value: Any, name: str, least: int = 0) -> int:
    try:
        count = operator.index(value)
    except TypeError:
        raise UsageError(f"{name}: expected a whole number; got {value!r}") from None
    if not least <= count < 1 << 31:
        raise UsageError(f"{name}: expected {least} or more, below 2^31; got {count}")
    return count


def _words(options: dict, is_flag: dict[str, bool]) -> list[str]:
    """As one would type them.

    is_flag: of every option of the program
    """
    out: list[str] = []
    unset: list[str] = []  # a preset may set them
    for name, value in options.items():
        option = name.replace("_", "-")
        opposite = "no-" + option
        if isinstance(value, np.bool_):
            value = bool(value)
        if option not in is_flag and opposite not in is_flag:
            out.append("--" + option)  # refused, with what may have been meant
        elif value is None:
            continue
        elif isinstance(value, bool) and (opposite in is_flag or is_flag[option]):
            meant, other = (option, opposite) if value else (opposite, option)
            if meant in is_flag:
                out.append("--" + meant)
            if other in is_flag:
                unset.append(f"--{other}=false")
        else:
            for item in value if isinstance(value, (list, tuple)) else [value]:
                if item is True:
                    out.append("--" + option)
                    continue
                is_length = name in _LENGTHS and not isinstance(item, str)
                out += ["--" + option, f"{item}mm" if is_length else str(item)]
    return unset + out  # the last one counts: of options that contradict none is dropped


def _told(progress: Optional[ProgressFunction]):
    if progress is None:
        return None
    return lambda *values: progress(Progress(*values))
