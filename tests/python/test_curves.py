"""Curves in images."""

import os
import subprocess

import numpy as np
import pytest
import surfseg
from discs import two_discs


def test_finds_curves_in_an_array():
    image, (in_ring, in_disc) = two_discs()
    disc = surfseg.segment(image, [in_disc])
    assert isinstance(disc, surfseg.Curve) and disc.outcome == "converged"
    assert disc.area_mm2 == pytest.approx(np.pi * 81, rel=0.02)
    assert disc.length_mm == pytest.approx(2 * np.pi * 9, rel=0.02)
    polygon, = disc.polygons
    assert np.abs(np.hypot(*(polygon - in_disc).T) - 9).max() < 0.3
    x, y = polygon.T
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2 == pytest.approx(disc.area_mm2)
    assert len(disc.points) == len(disc.segments) == len(polygon)
    assert disc.points.base is not None and not disc.points.flags.writeable
    assert disc.mask().shape == image.shape and disc.mask()[30, 64] == 1
    assert disc.mask().sum() == pytest.approx(np.pi * 81, rel=0.03)
    ring = surfseg.segment(image, [in_ring])
    areas = [np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1)) / 2
             for p in ring.polygons]
    assert sum(areas) == pytest.approx(ring.area_mm2)


def test_curves_have_millimetres():
    image, (_, in_disc) = two_discs()
    in_pixels = surfseg.segment(image, [in_disc])
    in_mm = surfseg.segment(image, [np.multiply(in_disc, 0.5)], spacing=0.5, space="mm")
    assert in_mm.area_mm2 == pytest.approx(in_pixels.area_mm2 / 4, rel=0.01)
    assert np.allclose(in_mm.points_in("px"), in_mm.points / 0.5)
    with pytest.raises(surfseg.UsageError, match="'px' or 'mm'"):
        surfseg.segment(image, [in_disc], space="ras")
    with pytest.raises(surfseg.UsageError, match="two numbers"):
        surfseg.segment(image, [(1, 2, 3)])
    with pytest.raises(surfseg.UsageError, match="one or two lengths"):
        surfseg.segment(image, [in_disc], spacing="wide")
    with pytest.raises(surfseg.UsageError, match="belongs to an image"):
        surfseg.segment(surfseg.phantom("ball", 16), [(0, 0, 0)], spacing=1)


def test_curves_are_those_of_the_program(tmp_path):
    curveseg = os.environ["CURVESEG_PROGRAM"]
    subprocess.run([curveseg, "phantom", "blob", "--size", "80", "--noise", "0.05", "-o",
                    tmp_path / "blob.png"], check=True, capture_output=True)
    curve = surfseg.segment(tmp_path / "blob.png", [(40, 40)])
    for name in ("blob.json", "blob.svg", "blob.csv", "blob.vtp", "mask.png"):
        curve.save(tmp_path / ("ours-" + name))
    for name in ("blob.json", "blob.svg", "blob.csv", "blob.vtp"):
        subprocess.run([curveseg, "segment", tmp_path / "blob.png", "--seed=40,40", "-o",
                        tmp_path / name, "--mask", tmp_path / "mask.png"], check=True,
                       capture_output=True)
        assert (tmp_path / name).read_bytes() == (tmp_path / ("ours-" + name)).read_bytes(), name
    assert (tmp_path / "mask.png").read_bytes() == (tmp_path / "ours-mask.png").read_bytes()
    with pytest.raises(surfseg.UsageError, match=".svg, .json"):
        curve.save(tmp_path / "blob.stl")


def test_a_dialogue_about_an_image():
    image, (in_ring, in_disc) = two_discs()
    dialogue = surfseg.Segmentation(image)
    one = dialogue.add(in_disc)
    two = dialogue.add(in_ring)
    assert two.area_mm2 > one.area_mm2
    recipe = dialogue.recipe()
    assert dialogue.undo() and len(dialogue.clicks()) == 1
    assert (dialogue.surface().points == one.points).all()
    again = surfseg.Segmentation(image)
    again.replay(recipe)
    assert (again.surface().points == two.points).all()
    assert again.clicks() == [(tuple(map(float, p)), True) for p in (in_disc, in_ring)]
