#!/usr/bin/python3
"""The scripted module with stand-ins for Slicer's modules: it loads, its logic sends points and takes
surfaces, and Slicer would take no other file of it for a module. No Slicer is here."""
import array
import importlib.util
import os
import shutil
import sys
import types
import unittest
from unittest import mock

HERE = os.path.dirname(os.path.abspath(__file__))
MODULE = os.path.join(os.path.dirname(os.path.dirname(HERE)), "tools", "slicer", "SurfsegStudio")


class Base:
    def __init__(self, *_):
        pass


class Points:
    """A list of control points: (status, position in RAS)."""

    def __init__(self, *points):
        self.points = points

    def GetNumberOfControlPoints(self):
        return len(self.points)

    def GetNthControlPointPositionStatus(self, n):
        return self.points[n][0]

    def GetNthControlPointPositionWorld(self, n, out):
        out[:] = self.points[n][1]

    def AddObserver(self, event, action):
        return id(action)

    def RemoveObserver(self, tag):
        pass

    def AddControlPointWorld(self, *point):
        self.points += ((2, point),)


HAS_VTK = all(importlib.util.find_spec(name) for name in ("vtk", "numpy"))


def load():
    slicer = mock.MagicMock()
    slicer.vtkMRMLMarkupsNode.PositionDefined = 2
    scripted = types.ModuleType("slicer.ScriptedLoadableModule")
    for name in ("", "Logic", "Widget"):
        setattr(scripted, "ScriptedLoadableModule" + name, type("Base" + name, (Base,), {}))
    names = ("ctk", "numpy", "qt", "vtk", "vtk.util")
    sys.modules.update({name: mock.MagicMock() for name in names})
    sys.modules.update({"slicer": slicer, "slicer.ScriptedLoadableModule": scripted})
    sys.path.insert(0, MODULE)
    import SurfsegStudio
    return SurfsegStudio


module = load()
from SurfsegStudioLib import client  # noqa: E402


def state(**more):
    found = {"id": 4, "has_surface": False, "surface": 0, "clicks": [], "measures": None, "verdict": None,
             "message": ""}
    found.update(more)
    return {"volume": {"path": "v.nrrd"}, "job": None, "error": None, "objects": [found]}


class Module(unittest.TestCase):
    def setUp(self):
        self.logic = module.SurfsegStudioLogic()
        self.logic.show = self.said = mock.Mock()
        self.studio = mock.Mock()
        self.logic._join(self.studio)

    def words(self):
        return self.said.call_args[0][0]

    def test_is_the_only_script_in_its_folder(self):
        scripts = [name for name in os.listdir(MODULE) if name.endswith(".py")]
        self.assertEqual(scripts, ["SurfsegStudio.py"])
        self.assertTrue(issubclass(module.SurfsegStudio, Base))

    def test_sends_points_once_for_all_their_events(self):
        self.studio.state.return_value = state()
        self.logic.observe(Points((2, (1, 2, 3)), (0, (9, 9, 9))), Points((2, (4, 5, 6))))
        for _ in range(5):
            self.logic._points_changed()
        self.logic.poll()
        self.logic.poll()
        self.studio.set_points.assert_called_once_with(4, [[1, 2, 3]], [[4, 5, 6]],
                                                       state=self.studio.state.return_value)
        self.assertEqual(self.words(), "Place a point inside the object")

    def test_goes_on_after_points_that_were_refused(self):
        self.studio.state.return_value = state()
        self.studio.set_points.side_effect = module.StudioRefused("outside the volume")
        self.logic.poll()
        self.logic.poll()
        self.assertEqual((self.studio.set_points.call_count, self.words()), (1, "outside the volume"))
        self.studio.set_points.side_effect = None
        self.logic._points_changed()
        self.logic.poll()
        self.assertEqual(self.words(), "Place a point inside the object")

    def test_sends_points_again_where_the_page_was_faster(self):
        self.studio.state.return_value = state()
        self.studio.set_points.side_effect = [module.StudioRefused("not where it was", 409), 1]
        self.logic.observe(Points((2, (1, 2, 3))), None)
        for _ in range(3):
            self.logic.poll()
        self.assertEqual(self.studio.set_points.call_count, 2)
        self.assertEqual(self.words(), "Place a point inside the object")

    def test_connecting_to_the_studio_that_it_started_leaves_it(self):
        own = module.Studio("http://127.0.0.1:8911/?token=ab")
        self.logic._process = process = mock.Mock(studio=own)
        self.logic._join(own)
        self.logic._has_new_points = False
        with mock.patch.object(module.Studio, "state"):
            self.logic.connect("http://localhost:8911/?token=ab")
            process.end.assert_not_called()
            self.assertIs(self.logic.studio, own)
            self.assertTrue(self.logic._has_new_points, "they are sent again")
            # The port of one that has ended may be another's.
            self.logic.connect("http://127.0.0.1:8911/?token=cd")
            process.end.assert_called_once_with()
            self.assertIsNot(self.logic.studio, own)
            self.logic._process = process = mock.Mock(studio=self.logic.studio)
            self.logic.connect("http://127.0.0.1:8912/?token=cd")
            process.end.assert_called_once_with()
            self.assertEqual(self.logic.studio.port, 8912)

    def connect_again(self):
        self.studio.is_same_as.return_value = True
        with mock.patch.object(module, "Studio"):
            self.logic.connect("http://127.0.0.1:8911/?token=ab")
        self.logic.poll()
        return [sorted(points) for points in self.studio.set_points.call_args[0][1:]]

    def test_connecting_again_takes_clicks_that_the_page_made(self):
        inside = Points((2, (1, 2, 3)))
        self.studio.state.return_value = state()
        self.logic.observe(inside, Points())
        self.logic.poll()
        self.studio.state.return_value = state(clicks=[{"side": "inside", "point": [1, 2, 3]},
                                                       {"side": "outside", "point": [7, 8, 9]}])
        self.assertEqual(self.connect_again(), [[[1, 2, 3]], [[7, 8, 9]]])

    def test_connecting_again_brings_nothing_back_that_was_moved_or_removed(self):
        inside = Points((2, (1, 2, 3)), (2, (4, 5, 6)))
        self.studio.state.return_value = state()
        self.logic.observe(inside, Points())
        self.logic.poll()
        # It did not answer in time, and has not done it.
        self.studio.state.return_value = state(clicks=[{"side": "inside", "point": [1, 2, 3]},
                                                       {"side": "inside", "point": [4, 5, 6]}])
        inside.points = ((2, (1, 2, 4)), (2, (4, 5, 6)))
        self.logic._points_changed()
        self.studio.set_points.side_effect = module.StudioError("no studio answers")
        with self.assertRaises(module.StudioError):
            self.logic.poll()
        self.studio.set_points.side_effect = None
        inside.points = ((2, (1, 2, 5)),)
        self.assertEqual(self.connect_again(), [[[1, 2, 5]], []])
        # What another studio has was not sent to it.
        self.logic._join(self.studio)
        self.logic.poll()
        self.assertEqual(sorted(self.studio.set_points.call_args[0][1]), [[1, 2, 3], [1, 2, 5], [4, 5, 6]])

    def test_shows_surface_and_verdict(self):
        self.studio.state.return_value = state(
            has_surface=True, surface=3, clicks=[{"side": "inside", "point": [1, 2, 3]}],
            measures={"volume_ml": 1.5, "area_cm2": 7.25}, verdict={"trust": "check", "words": "right in 3 of 5"})
        self.studio.surface.return_value.frame = 0
        self.logic.observe(Points((2, (1, 2, 3))), None)
        with mock.patch.object(module, "poly_data") as poly_data:
            self.logic.poll()
            self.logic.poll()
        poly_data.assert_called_once_with(self.studio.surface.return_value)
        self.assertEqual(self.words(), "1.5 ml, 7.25 cm2; check: right in 3 of 5")

    def test_the_scene_keeps_the_volume_where_it_was(self):
        volume = mock.Mock()
        util = module.slicer.util
        util.saveNode.reset_mock()
        util.exportNode.return_value = True
        with mock.patch.object(module, "StudioProcess") as process:
            self.logic.start("surfseg", volume)
        path = util.exportNode.call_args[0][1]
        util.exportNode.assert_called_once_with(volume, path, {"useCompression": 0}, world=True)
        util.saveNode.assert_not_called()
        self.assertEqual(process.call_args[0][:2], ("surfseg", path))
        folder = os.path.dirname(path)
        for name in (path, path + ".surfseg.json"):  # as Slicer and the studio write them
            with open(name, "w"):
                pass
        self.logic.tell = told = mock.Mock()
        self.logic.end()
        self.assertFalse(os.path.exists(folder))
        told.assert_not_called()

    def test_what_was_exported_from_the_page_stays(self):
        module.slicer.util.exportNode.return_value = True
        self.logic.tell = told = mock.Mock()
        with mock.patch.object(module, "StudioProcess") as process:
            self.logic.start("surfseg", mock.Mock())
        folder = os.path.dirname(process.call_args[0][1])
        self.addCleanup(shutil.rmtree, folder)
        for name in ("volume.nrrd", "liver.stl"):
            with open(os.path.join(folder, name), "w"):
                pass
        self.logic.end()
        self.assertEqual(os.listdir(folder), ["liver.stl"])
        self.assertIn(folder, told.call_args[0][0])

    def test_connecting_to_a_studio_that_has_clicks_takes_them_first(self):
        clicks = [{"side": "inside", "point": [1, 2, 3]}, {"side": "inside", "point": [4, 5, 6]},
                  {"side": "outside", "point": [7, 8, 9]}]
        self.studio.state.return_value = state(clicks=clicks)
        inside, outside = Points((2, (4, 5, 6)), (2, (0, 0, 0))), Points()

        def make_list(side):
            self.assertEqual(side, "outside")
            self.logic.observe(inside, outside)

        self.logic.make_list = make_list
        self.logic.observe(inside, None)
        self.logic.poll()
        self.assertEqual(sorted(self.studio.set_points.call_args[0][1]), [[0, 0, 0], [1, 2, 3], [4, 5, 6]])
        self.assertEqual(self.studio.set_points.call_args[0][2], [[7, 8, 9]])
        # What is taken out of the lists afterwards goes there, too.
        inside.points = inside.points[:1]
        self.logic._points_changed()
        self.logic.poll()
        self.assertEqual(self.studio.set_points.call_args[0][1:], ([[4, 5, 6]], [[7, 8, 9]]))

    def test_exports_the_final_surface_alone(self):
        good = dict(has_surface=True, surface=3, clicks=[{"side": "inside", "point": [1, 2, 3]}],
                    measures={"volume_ml": 1.5, "area_cm2": 7.25, "passed": True, "verification": "closed"}, outdated=False)
        self.logic.observe(Points((2, (1, 2, 3))), None)
        self.logic.tell = told = mock.Mock()
        imported = module.slicer.modules.segmentations.logic().ImportModelToSegmentationNode
        imported.reset_mock()
        failed = {**good["measures"], "passed": False, "verification": "triangles meet"}
        evolving = {**state(**good), "job": {"id": 1, "object": 4, "stage": "evolve", "step": 3, "frame": 0}}
        for found, frame, words in ((state(), 0, "no surface"), (state(**{**good, "measures": None}), 0, "no surface"),
                                    (state(**{**good, "measures": failed}), 0, "triangles meet"),
                                    (evolving, 0, "still evolves"), (state(**good), 7, "evolves anew")):
            self.studio.state.return_value = found
            self.studio.surface.return_value.frame = frame
            with mock.patch.object(module, "poly_data"), self.assertRaisesRegex(module.StudioError, words):
                self.logic.export(None)
            imported.assert_not_called()
        self.studio.surface.return_value.frame = 0
        other = {**evolving, "job": {**evolving["job"], "object": 5}}
        for found, n_told in ((state(**good), 0), (other, 0), (state(**{**good, "outdated": True}), 1)):
            self.studio.state.return_value = found
            with mock.patch.object(module, "poly_data") as poly_data:
                self.logic.export(None)
            poly_data.assert_called_with(self.studio.surface.return_value)
            imported.assert_called_once()
            imported.reset_mock()
            self.assertEqual(told.call_count, n_told)
        self.logic.studio = None
        with self.assertRaisesRegex(module.StudioError, "no studio"):
            self.logic.export(None)

    def test_another_studio_begins_without_the_surface_of_the_one_before(self):
        model = self.logic._model = mock.Mock()
        self.logic._join(mock.Mock())
        model.SetAndObservePolyData.assert_called_once()
        module.slicer.mrmlScene.GetNodeByID.return_value = None  # removed from the scene
        model.reset_mock()
        self.logic._join(mock.Mock())
        model.SetAndObservePolyData.assert_not_called()
        module.slicer.mrmlScene.GetNodeByID.return_value = mock.MagicMock()

    @unittest.skipUnless(HAS_VTK, "Python has no vtk or no numpy")
    def test_makes_meshes_of_vtk(self):
        for name in ("numpy", "vtk", "vtk.util"):
            sys.modules.pop(name, None)
        import numpy
        import vtk
        from vtk.util import numpy_support
        surface = client.Surface(array.array("f", (0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)),
                                 array.array("I", (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)),
                                 [array.array("f", (1, 2, 3, 4)), array.array("f", (5, 6, 7, 8))])
        with mock.patch.multiple(module, numpy=numpy, vtk=vtk, numpy_support=numpy_support):
            mesh = module.poly_data(surface)
        self.assertEqual((mesh.GetNumberOfPoints(), mesh.GetNumberOfCells()), (4, 4))
        self.assertEqual(mesh.GetPoint(3), (0, 0, 1))
        self.assertEqual([mesh.GetCell(1).GetPointId(n) for n in range(3)], [0, 1, 3])
        self.assertEqual(mesh.GetPointData().GetArray("edge_strength").GetValue(2), 7)
        measured = vtk.vtkMassProperties()
        measured.SetInputData(mesh)
        self.assertAlmostEqual(measured.GetVolume(), 1 / 6, 6)


if __name__ == "__main__":
    unittest.main()
