"""Volumes, images and points as segment() takes them."""

from __future__ import annotations

import os
from typing import Any, Optional, Sequence, Union

import numpy as np

from . import _surfseg
from ._surfseg import Image, UsageError, Volume


def read(path: Union[str, os.PathLike], frame: int = 0,
         series_uid: Optional[str] = None) -> Volume:
    """A volume from a file or a DICOM folder. Raises InputError."""
    return _surfseg.read(os.fspath(path), frame, series_uid)


def as_volume(image: Any, affine: Optional[np.ndarray] = None) -> Volume:
    """What segment() takes as an image."""
    if isinstance(image, Volume):
        return image
    if isinstance(image, (str, os.PathLike)):
        return read(image)
    if _is_simple_itk(image):
        return _from_simple_itk(image)
    if _is_nibabel(image):
        name = image.get_filename() if hasattr(image, "get_filename") else None
        return _surfseg.Volume(np.asanyarray(image.dataobj), _affine_of_nibabel(image), name or "")
    try:
        n_axes = np.ndim(image)
    except ValueError as error:  # rows of different lengths
        raise UsageError(f"image: {error}") from None
    if n_axes not in (2, 3):
        what = (f"an array of shape {np.shape(image)}" if isinstance(image, np.ndarray)
                else type(image).__name__)
        raise UsageError("image: expected a path, a nibabel or SimpleITK image, or an array of two "
                         f"or three dimensions; got {what}")
    if affine is None:
        colours = ("; if its last axis holds colours, give one of them or their mean"
                   if np.shape(image)[-1] in (3, 4) else "")
        raise UsageError("affine: an array needs the 4 x 4 matrix from voxel index to RAS mm"
                         + colours)
    return _surfseg.Volume(np.asanyarray(image), np.asarray(affine), "")


def as_image(image: Any, affine: Optional[np.ndarray] = None,
             spacing: Union[float, Sequence[float], None] = None) -> Union[Volume, Image]:
    """What segment() takes: a volume, or an image of two dimensions."""
    has_own = (isinstance(image, (Volume, Image, str, os.PathLike))
               or _is_simple_itk(image) or _is_nibabel(image))
    if affine is not None and has_own:
        raise UsageError("affine: belongs to an array; a file, a Volume, an Image and an image of "
                         "nibabel or SimpleITK have their own")
    if isinstance(image, np.ma.MaskedArray) and np.ma.is_masked(image):
        raise UsageError("image: a masked array; give its values, image.filled(...)")
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


def _is_simple_itk(image: Any) -> bool:
    return hasattr(image, "GetDirection") and hasattr(image, "GetOrigin")


def _is_nibabel(image: Any) -> bool:
    return hasattr(image, "affine") and hasattr(image, "dataobj")


def _affine_of_nibabel(image: Any) -> np.ndarray:
    """To mm: nibabel leaves lengths in the unit that a NIfTI header states."""
    affine = np.array(image.affine, dtype=float)
    if hasattr(image.header, "get_xyzt_units"):
        # Not by that function: it fails at codes that NIfTI does not know, here and of the time.
        unit = int(image.header["xyzt_units"]) & 7
        affine[:3] *= {1: 1e3, 3: 1e-3}.get(unit, 1)  # metres, micrometres
    return affine


def _spacing(spacing: Union[float, Sequence[float]]) -> list[float]:
    try:
        sizes = np.broadcast_to(np.asarray(spacing, dtype=float), 2)
    except (TypeError, ValueError):
        raise UsageError(f"spacing: expected one or two lengths [mm]; got {spacing!r}") from None
    return [float(size) for size in sizes]


def _from_simple_itk(image: Any) -> Volume:
    """Index order [z, y, x] and LPS become [i, j, k] and RAS."""
    if len(image.GetSpacing()) != 3:
        raise UsageError(f"image: expected three dimensions; got {len(image.GetSpacing())}")
    if hasattr(image, "__array__"):
        values = np.asarray(image)
    else:
        import SimpleITK

        values = SimpleITK.GetArrayViewFromImage(image)
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(image.GetDirection(), (3, 3)) * np.asarray(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return _surfseg.Volume(values.T, np.diag([-1, -1, 1, 1]) @ affine, "")


def points_of(points: Any, what: str, n: int) -> np.ndarray:
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


def pixel(space: str, image: Image) -> np.ndarray:
    """Size of the unit of a space in an image [mm]."""
    if space not in ("px", "mm"):
        raise UsageError(f"space: expected 'px' or 'mm' in an image; got '{space}'")
    return np.array(image.spacing_mm if space == "px" else (1.0, 1.0))


def to_ras(points: np.ndarray, space: str, affine: np.ndarray) -> np.ndarray:
    if space == "ijk":
        return points @ affine[:3, :3].T + affine[:3, 3]
    return points * _signs(space)


def from_ras(points: np.ndarray, space: str, affine: np.ndarray) -> np.ndarray:
    if space == "ijk":
        return np.linalg.solve(affine[:3, :3], (points - affine[:3, 3]).T).T
    return points * _signs(space)


def _signs(space: str) -> np.ndarray:
    if space not in ("ras", "lps"):
        raise UsageError(f"space: expected 'ras', 'lps' or 'ijk'; got '{space}'")
    return np.array([1.0, 1.0, 1.0] if space == "ras" else [-1.0, -1.0, 1.0])
