"""Points inside and outside in Slicer's views, the surface from a running `surfseg studio`.

Thin: what does not need Slicer is in SurfsegStudioLib/client.py."""
import contextlib
import os
import tempfile

import ctk
import numpy
import qt
import slicer
import vtk
from slicer.ScriptedLoadableModule import (ScriptedLoadableModule, ScriptedLoadableModuleLogic,
                                           ScriptedLoadableModuleWidget)
from vtk.util import numpy_support

from SurfsegStudioLib.client import (StudioError, StudioProcess, StudioRefused, Studio,
                                     SurfaceWatch, environment_without_slicer, lacking)

POLL_MS = 150
SETTING = "SurfsegStudio/program"
VOLUME = "volume.nrrd"
COLOURS = {"inside": (0.2, 0.9, 0.3), "outside": (0.95, 0.25, 0.2)}


class SurfsegStudio(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "Surfseg Studio"
        parent.categories = ["Segmentation"]
        parent.dependencies = []
        parent.contributors = ["surfseg"]
        parent.helpText = ("Place points inside an object, and outside where its surface goes too far: "
                           "surfseg studio evolves the surface meanwhile. See docs/slicer.md of surfseg.")
        parent.acknowledgementText = "GPL-3.0-or-later"


class SurfsegStudioWidget(ScriptedLoadableModuleWidget):
    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.logic = SurfsegStudioLogic()
        self.logic.show = self.show
        self.logic.tell = lambda text: slicer.util.infoDisplay(text, windowTitle="Surfseg Studio")
        self.logic.make_list = self._make_list
        self._add_studio()
        self._add_points()
        self._add_results()
        self.layout.addStretch(1)
        self.timer = qt.QTimer()
        self.timer.setInterval(POLL_MS)
        self.timer.connect("timeout()", self._poll)

    def _group(self, title):
        group = ctk.ctkCollapsibleButton()
        group.text = title
        self.layout.addWidget(group)
        return qt.QFormLayout(group)

    @staticmethod
    def _selector(kind, may_create):
        box = slicer.qMRMLNodeComboBox()
        box.nodeTypes = [kind]
        box.addEnabled = box.removeEnabled = box.renameEnabled = may_create
        box.noneEnabled = True
        box.setMRMLScene(slicer.mrmlScene)
        return box

    @staticmethod
    def _button(text, action):
        button = qt.QPushButton(text)
        button.connect("clicked(bool)", lambda _: action())
        return button

    def _add_studio(self):
        form = self._group("Studio")
        self.volume = self._selector("vtkMRMLScalarVolumeNode", False)
        form.addRow("Volume", self.volume)
        self.program = qt.QLineEdit(qt.QSettings().value(SETTING, "surfseg"))
        self.program.toolTip = "The program surfseg, by its path if it is not on PATH"
        form.addRow("Program", self.program)
        form.addRow(self._button("Start a studio for this volume", self._start))
        self.address = qt.QLineEdit()
        self.address.placeholderText = "http://127.0.0.1:PORT/?token=..."
        form.addRow("Or address", self.address)
        form.addRow(self._button("Connect", self._connect))

    def _add_points(self):
        form = self._group("Points")
        self.inside = self._place_widget(form, "Inside", "inside")
        self.outside = self._place_widget(form, "Outside", "outside")

    def _place_widget(self, form, label, name):
        widget = slicer.qSlicerSimpleMarkupsWidget()
        widget.setMRMLScene(slicer.mrmlScene)
        widget.markupsSelectorComboBox().baseName = name
        widget.defaultNodeColor = qt.QColor.fromRgbF(*COLOURS[name])
        widget.tableWidget().setMaximumHeight(90)
        widget.connect("markupsNodeChanged()", self._points_changed)
        form.addRow(label, widget)
        return widget

    def _add_results(self):
        form = self._group("Surface")
        self.status = qt.QLabel("No studio")
        self.status.wordWrap = True
        form.addRow(self.status)
        form.addRow(self._button("Stop evolving", lambda: self._try(self.logic.stop)))
        form.addRow(self._button("Export to segmentation", lambda: self._try(self._export)))

    def show(self, text):
        self.status.text = text

    def _try(self, action):
        try:
            action()
        except StudioError as error:
            slicer.util.errorDisplay(str(error), windowTitle="Surfseg Studio")

    def _start(self):
        volume = self.volume.currentNode()
        if volume is None:
            slicer.util.errorDisplay("Choose a volume first.", windowTitle="Surfseg Studio")
            return
        qt.QSettings().setValue(SETTING, self.program.text)
        self._try(lambda: self.logic.start(self.program.text, volume))
        self._follow()

    def _connect(self):
        self._try(lambda: self.logic.connect(self.address.text))
        self._follow()

    def _follow(self):
        if self.logic.studio is None:
            return
        self.address.text = self.logic.studio.address
        self._points_changed()
        self.timer.start()

    def _points_changed(self):
        self.logic.observe(self.inside.currentNode(), self.outside.currentNode())

    def _make_list(self, side):
        """Of a side that has none, for what a studio has."""
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", side)
        node.CreateDefaultDisplayNodes()
        node.GetDisplayNode().SetSelectedColor(*COLOURS[side])
        (self.inside if side == "inside" else self.outside).setCurrentNode(node)
        self._points_changed()

    def _poll(self):
        try:
            self.logic.poll()
        except StudioError as error:
            self.timer.stop()
            self.show(str(error))

    def _export(self):
        self.logic.export(self.volume.currentNode())

    def cleanup(self):
        self.timer.stop()
        self.logic.tell = print  # no window: Slicer may be closing
        self.logic.end()


class SurfsegStudioLogic(ScriptedLoadableModuleLogic):
    """One object of one studio, and the model that shows it."""

    def __init__(self):
        ScriptedLoadableModuleLogic.__init__(self)
        self.studio = None
        self.show = print  # a line that the next one replaces
        self.tell = print  # what is to be read
        self.make_list = lambda side: None
        self._process = None
        self._folder = None
        self._watch = None
        self._object = None
        self._model = None
        self._lists = (None, None)
        self._observed = []
        self._has_new_points = False
        self._sent = [[], []]  # points of each list that may have become clicks of the studio
        self._refusal = ""  # of the points as they are

    def start(self, program, volume):
        """A studio of its own, on a copy of the volume in a temporary folder."""
        self.end()
        self._folder = tempfile.mkdtemp(prefix="surfseg-slicer-")
        path = os.path.join(self._folder, VOLUME)
        # Not saveNode(), which would have the scene keep the volume in this folder; as it lies in the
        # world, where points and surfaces are.
        if not slicer.util.exportNode(volume, path, {"useCompression": 0}, world=True):
            raise StudioError(f"{path}: the volume cannot be written")
        self._process = StudioProcess(program, path, environment_without_slicer(os.environ))
        self._join(self._process.studio)

    def connect(self, address):
        """A studio that runs already, with its volume open."""
        studio = Studio(address)
        studio.state()
        if self.studio is not None and self.studio.is_same_as(studio):
            # To join it anew would end one that was started here, and forget what was sent.
            self._object = None
            self._has_new_points = True
            return
        self.end()
        self._join(studio)

    def _join(self, studio):
        self.studio = studio
        self._watch = self._object = None
        self._sent = [[], []]
        if self._is_model_there():
            self._show_surface(None)  # that of another studio
        self._has_new_points = True

    def observe(self, inside, outside):
        for node, tag in self._observed:
            node.RemoveObserver(tag)
        self._observed = []
        self._lists = (inside, outside)
        events = (slicer.vtkMRMLMarkupsNode.PointPositionDefinedEvent,
                  slicer.vtkMRMLMarkupsNode.PointPositionUndefinedEvent,
                  slicer.vtkMRMLMarkupsNode.PointModifiedEvent,
                  slicer.vtkMRMLMarkupsNode.PointRemovedEvent)
        for node in (inside, outside):
            for event in events if node is not None else ():
                self._observed.append((node, node.AddObserver(event, self._points_changed)))
        self._points_changed()

    def _points_changed(self, *_):
        self._has_new_points = True  # sent at the next poll, however many events there are

    @staticmethod
    def _points(node):
        out = []
        for n in range(node.GetNumberOfControlPoints() if node is not None else 0):
            if node.GetNthControlPointPositionStatus(n) == slicer.vtkMRMLMarkupsNode.PositionDefined:
                point = [0.0, 0.0, 0.0]
                node.GetNthControlPointPositionWorld(n, point)
                out.append(point)
        return out

    def poll(self):
        if self.studio is None:
            return
        state = self.studio.state()
        if state["volume"] is None or not state["objects"]:
            self.show(state["error"]["text"] if state["error"] else "Reading the volume")
            return
        if self._object is None:
            self._take_clicks(state["objects"][0]["clicks"])
            self._object = state["objects"][0]["id"]
            self._watch = SurfaceWatch(self.studio, self._object)
        if self._has_new_points:
            self._has_new_points = False
            self._send_points(state)
        surface = self._watch.poll(state)
        if surface is not None:
            self._show_surface(None if surface == "gone" else surface)
        self._show_words(state)

    def _take_clicks(self, clicks):
        """What a studio that was joined has and the lists have not, before they are sent: what is not
        in them is taken back there. What was sent and is not in them any more was moved or removed
        here."""
        for n, side in enumerate(("inside", "outside")):
            points = lacking(clicks, side, self._points(self._lists[n]) + self._sent[n])
            if points and self._lists[n] is None:
                self.make_list(side)
            for point in points:
                self._lists[n].AddControlPointWorld(*point)

    def _send_points(self, state):
        self._refusal = ""
        points = [self._points(node) for node in self._lists]
        # Until all of it is done the studio may have those from before, too.
        self._sent = [before + now for before, now in zip(self._sent, points)]
        try:
            self.studio.set_points(self._object, *points, state=state)
            self._sent = points
        except StudioRefused as error:
            if error.status == 409:  # the page was faster: again, by the next state
                self._has_new_points = True
            else:
                self._refusal = str(error)

    def _show_words(self, state):
        found = next((o for o in state["objects"] if o["id"] == self._object), None)
        if self._refusal:
            self.show(self._refusal)
        elif state["job"] is not None:
            self.show(f"{state['job']['stage']}, step {state['job']['step']}")
        elif found and found["measures"]:
            verdict = found["verdict"]
            self.show(f"{found['measures']['volume_ml']:.4g} ml, {found['measures']['area_cm2']:.4g} cm2" +
                      (f"; {verdict['trust']}: {verdict['words']}" if verdict else ""))
        elif found and found["message"]:
            self.show(found["message"])
        else:
            self.show("Place a point inside the object")

    def _is_model_there(self):
        return self._model is not None and \
            slicer.mrmlScene.GetNodeByID(self._model.GetID()) is not None

    def _show_surface(self, surface):
        if not self._is_model_there():
            self._model = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "surfseg")
            self._model.CreateDefaultDisplayNodes()
            self._model.GetDisplayNode().SetVisibility2D(True)
            self._model.GetDisplayNode().SetColor(1.0, 0.83, 0.0)
        self._model.SetAndObservePolyData(poly_data(surface) if surface else vtk.vtkPolyData())

    def stop(self):
        if self.studio is not None:
            self.studio.do("stop")

    def export(self, volume):
        """A segment of the object's final surface."""
        if self.studio is None:
            raise StudioError("There is no studio.")
        self.poll()  # sends points that have just been placed
        state = self.studio.state()
        found = next((o for o in state["objects"] if o["id"] == self._object), None)
        if state["job"] is not None and state["job"]["object"] == self._object:
            raise StudioError("The surface still evolves: wait until it is at rest, or stop it.")
        if found is None or not found["measures"] or not found["clicks"]:
            raise StudioError("There is no surface yet.")
        if not found["measures"]["passed"]:
            raise StudioError(f"The surface is not sound: {found['measures']['verification']}.")
        surface = self.studio.surface(self._object)
        if surface.frame > 0:
            raise StudioError("The surface evolves anew: wait until it is at rest.")
        self._show_surface(surface)
        segmentation = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", "surfseg")
        if volume is not None:
            segmentation.SetReferenceImageGeometryParameterFromVolumeNode(volume)
        segmentation.CreateDefaultDisplayNodes()
        slicer.modules.segmentations.logic().ImportModelToSegmentationNode(self._model, segmentation)
        if found["outdated"]:
            self.tell("The segment was made, but the surface does not heed what was done last.")
        return segmentation

    def end(self):
        if self._process is not None:
            self._process.end()
        if self._folder is not None:
            self._leave_folder()
        self._process = self._folder = self.studio = None

    def _leave_folder(self):
        """The page exports into it: what a person has put there stays."""
        for name in (VOLUME, VOLUME + ".surfseg.json"):
            with contextlib.suppress(OSError):
                os.remove(os.path.join(self._folder, name))
        with contextlib.suppress(OSError):
            os.rmdir(self._folder)
        if os.path.isdir(self._folder):
            self.tell(f"What was exported from the studio's page is in {self._folder}")


def poly_data(surface):
    """The surface as Slicer's models have it: RAS mm."""
    points = numpy.frombuffer(surface.points, dtype=numpy.float32).reshape(-1, 3)
    triangles = numpy.frombuffer(surface.triangles, dtype=numpy.uint32).reshape(-1, 3)
    cells = numpy.empty((len(triangles), 4), dtype=numpy.int64)
    cells[:, 0] = 3
    cells[:, 1:] = triangles
    vtk_points = vtk.vtkPoints()
    vtk_points.SetData(numpy_support.numpy_to_vtk(points, deep=True))
    vtk_cells = vtk.vtkCellArray()
    vtk_cells.SetCells(len(triangles), numpy_support.numpy_to_vtkIdTypeArray(cells.ravel(), deep=True))
    out = vtk.vtkPolyData()
    out.SetPoints(vtk_points)
    out.SetPolys(vtk_cells)
    for name, values in zip(("deviation_mm", "edge_strength"), surface.arrays):
        array = numpy_support.numpy_to_vtk(numpy.frombuffer(values, dtype=numpy.float32), deep=True)
        array.SetName(name)
        out.GetPointData().AddArray(array)
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(out)
    normals.SplittingOff()
    normals.Update()
    return normals.GetOutput()
