"""Exported files, read by a reader that is not ours: read_back.py READER [FOLDER].

Says for each format what docs/file-formats.md has in its table: the reader, whether points and
triangles are those that were verified, the largest distance, and the frame. 77, "skipped", where
the reader is missing.
"""

import ctypes
import ctypes.util
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

import scans

LPS = np.diag([-1.0, -1, 1])
RAS = np.eye(3)
# To left, superior, anterior: glTF's axes for a patient who stands and looks at the viewer.
GLTF = np.array([[-1000.0, 0, 0], [0, 0, 1000], [0, 1000, 0]])


def truth(path):
    """Points in RAS mm and triangles, in the words of an OBJ file."""
    points = np.array(re.findall(r"^v (\S+) (\S+) (\S+)$", path.read_text(), re.M), float)
    faces = np.array(re.findall(r"^f (\d+) (\d+) (\d+)$", path.read_text(), re.M), int) - 1
    return points @ LPS, faces


def check(name, reader, frame, to_ras, points, triangles, expected, tolerance_mm=0.0, say=""):
    """Corner by corner, so that a reader may number the points as it likes."""
    points, triangles = np.asarray(points, float) @ to_ras.T, np.asarray(triangles)
    wanted, faces = expected
    assert len(points) == len(wanted), f"{name}: {len(points)} points, not {len(wanted)}"
    assert len(triangles) == len(faces), f"{name}: {len(triangles)} triangles, not {len(faces)}"
    largest = np.linalg.norm(points[triangles] - wanted[faces], axis=2).max()
    assert largest <= tolerance_mm, f"{name}: a corner is {largest} mm off"
    assert scans.distances(points, "liver").max() < 0.4, f"{name}: not where the ball is"
    print(f"| {name} | {reader} | {len(points)} and {len(triangles)}, the same | {largest:.2g} mm "
          f"| {frame}{say} |")


def check_curvature(curvature, name):
    """A ball's is 2 / r."""
    expected = 2 / scans.BALLS["liver"][1]
    assert abs(np.median(curvature) / expected - 1) < 0.05, f"{name}: {np.median(curvature)}"


class Files:
    """One surface in every format, of an oblique NIfTI scan."""

    def __init__(self, folder):
        self.folder = folder
        scans.write_nifti(folder / "scan.nii")
        scans.segment(folder / "scan.nii", "-o", folder / "{object}.obj")
        self.expected = truth(folder / "liver.obj")

    def write(self, ending, *words):
        scans.segment(self.folder / "scan.nii", "-o", self.folder / ("{object}" + ending), *words)
        return self.folder / ("liver" + ending)


def nibabel(folder):
    import nibabel as reader

    files = Files(folder)
    path = files.write(".surf.gii", "--mask", folder / "labels.nii.gz")
    said = f"nibabel {reader.__version__}"
    points, triangles = reader.load(path).agg_data()
    check(".gii", said, "scanner RAS mm", RAS, points, triangles, files.expected)
    shape = reader.load(folder / "liver.shape.gii")
    arrays = {array.metadata["Name"]: array.data for array in shape.darrays}
    assert list(arrays) == ["curvature_per_mm", "deviation_mm", "edge_strength", "has_edge"]
    assert all(len(array) == len(points) for array in arrays.values())
    check_curvature(arrays["curvature_per_mm"], path)
    labels = reader.load(folder / "labels.nii.gz")
    assert np.allclose(labels.affine, scans.AFFINE, atol=1e-5)
    check_labels(np.asanyarray(labels.dataobj), scans.AFFINE)
    print(f"| .nii.gz (labels) | {said} | every voxel | | affine within 1e-5 |")


def check_labels(labels, affine):
    """Voxels whose centres are clearly inside or outside have the right label."""
    points = np.moveaxis(np.indices(scans.SHAPE), 0, -1) @ affine[:3, :3].T
    for label, (index, radius) in enumerate(scans.BALLS.values(), start=1):
        distance = np.linalg.norm(points - affine[:3, :3] @ index, axis=-1) - radius
        assert (labels[distance < -0.4] == label).all(), f"label {label}: voxels are missing"
        assert (labels[distance > 0.4] != label).all(), f"label {label}: too many voxels"


def vtk_polygons(data):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return (vtk_to_numpy(data.GetPoints().GetData()),
            vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def vtk(folder):
    import vtk as reader
    from vtkmodules.util.numpy_support import vtk_to_numpy

    files = Files(folder)
    version = reader.vtkVersion.GetVTKVersion()
    for ending, name in ((".stl", "vtkSTLReader"), (".obj", "vtkOBJReader"),
                         (".ply", "vtkPLYReader"), (".vtp", "vtkXMLPolyDataReader")):
        path = files.write(ending) if ending != ".obj" else folder / "liver.obj"
        source = getattr(reader, name)()
        source.SetFileName(str(path))
        source.Update()
        # The doubles of a .vtp file are what the floats of the others are rounded from.
        check(ending, f"{name} {version}", "LPS mm", LPS, *vtk_polygons(source.GetOutput()),
              files.expected, 5e-5 if ending == ".vtp" else 0)
    check_curvature(vtk_to_numpy(source.GetOutput().GetPointData().GetArray("curvature_per_mm")),
                    ".vtp")
    assert source.GetOutput().GetFieldData().GetAbstractArray("SPACE").GetValue(0) == "LPS"
    source = reader.vtkGLTFReader()
    source.SetFileName(str(files.write(".glb")))
    source.ApplyDeformationsToGeometryOn()
    flat = reader.vtkCompositeDataGeometryFilter()
    flat.SetInputConnection(source.GetOutputPort())
    flat.Update()
    check(".glb", f"vtkGLTFReader {version}", "metres; +X left, +Y superior, +Z anterior", GLTF,
          *vtk_polygons(flat.GetOutput()), files.expected, 1e-4)
    check_materials(reader, folder)


def check_materials(reader, folder):
    """The colour that VTK's importer finds in the .mtl file beside an OBJ file."""
    window = reader.vtkRenderWindow()
    importer = reader.vtkOBJImporter()
    importer.SetFileName(str(folder / "liver.obj"))
    importer.SetFileNameMTL(str(folder / "liver.mtl"))
    importer.SetTexturePath(str(folder))
    renderer = reader.vtkRenderer()
    window.AddRenderer(renderer)
    importer.SetRenderWindow(window)
    importer.Read()
    colour = renderer.GetActors().GetLastActor().GetProperty().GetDiffuseColor()
    wanted = [float(x) for x in re.search("^Kd (.*)$", (folder / "liver.mtl").read_text(),
                                          re.M).group(1).split()]
    assert np.allclose(colour, wanted) and not np.allclose(colour, colour[0]), colour
    print("| .obj + .mtl | vtkOBJImporter | | | its colour |")


def meshio(folder):
    import meshio as reader

    files = Files(folder)
    for ending in (".stl", ".obj", ".ply"):
        path = files.write(ending) if ending != ".obj" else folder / "liver.obj"
        mesh = reader.read(path)
        points, triangles = mesh.points, mesh.cells_dict["triangle"]
        if ending == ".stl":  # its points are corners
            points, triangles = merged(points, triangles)
        check(ending, f"meshio {reader.__version__}", "LPS mm", LPS, points, triangles,
              files.expected)
    check_curvature(mesh.point_data["curvature_per_mm"], ".ply")
    assert {"deviation_mm", "edge_strength", "has_edge"} <= set(mesh.point_data)


def merged(points, triangles):
    unique, number = np.unique(points, axis=0, return_inverse=True)
    return unique, number.reshape(-1)[triangles]


class Library3mf:
    """lib3mf 1.8 by its C functions; each returns 0 if all went well."""

    def __init__(self):
        name = ctypes.util.find_library("3MF")
        self.library = ctypes.CDLL(name) if name else None

    def __call__(self, function, *arguments):
        code = getattr(self.library, "lib3mf_" + function)(*arguments)
        assert code == 0, f"lib3mf_{function}: {code & 0xffffffff:#x}"

    def get(self, function, kind, *arguments):
        out = kind()
        self(function, *arguments, ctypes.byref(out))
        return out

    def text(self, function, *arguments):
        buffer, n = ctypes.create_string_buffer(256), ctypes.c_uint32()
        self(function, *arguments, buffer, 256, ctypes.byref(n))
        return buffer.value.decode()


def lib3mf(folder):
    library = Library3mf()
    pointer, number = ctypes.c_void_p, ctypes.c_uint32
    files = Files(folder)
    path = files.write(".3mf")
    model = library.get("createmodel", pointer)
    reader = library.get("model_queryreader", pointer, model, b"3mf")
    library("reader_readfromfileutf8", reader, str(path).encode())
    assert library.get("reader_getwarningcount", number, reader).value == 0
    assert library.get("model_getunit", number, model).value == 1  # millimetre
    meshes = library.get("model_getmeshobjects", pointer, model)
    assert library.get("resourceiterator_movenext", ctypes.c_int, meshes).value
    mesh = library.get("resourceiterator_getcurrent", pointer, meshes)
    assert not library.get("resourceiterator_movenext", ctypes.c_int, meshes).value
    assert library.text("object_getnameutf8", mesh) == "liver"
    assert library.get("meshobject_ismanifoldandoriented", ctypes.c_int, mesh).value
    n = library.get("meshobject_getvertexcount", number, mesh).value
    points = np.empty((n, 3), np.float32)
    library("meshobject_getvertices", mesh, points.ctypes.data_as(pointer), n, None)
    n = library.get("meshobject_gettrianglecount", number, mesh).value
    triangles = np.empty((n, 3), np.uint32)
    library("meshobject_gettriangleindices", mesh, triangles.ctypes.data_as(pointer), n, None)
    check(".3mf", "lib3mf 1.8", "LPS mm", LPS, points, triangles, files.expected,
          say="; manifold and oriented, name and colour")
    materials = library.get("model_getbasematerials", pointer, model)
    assert library.get("resourceiterator_movenext", ctypes.c_int, materials).value
    material = library.get("resourceiterator_getcurrent", pointer, materials)
    colour = [ctypes.c_uint8() for _ in range(4)]
    library("basematerial_getdisplaycolor", material, 0, *map(ctypes.byref, colour))
    wanted = re.search("^Kd (.*)$", (folder / "liver.mtl").read_text(), re.M).group(1).split()
    assert [c.value for c in colour[:3]] == [round(255 * float(x)) for x in wanted]
    assert colour[3].value == 255


    check_solids(library, folder)


def check_solids(library, folder):
    """Two balls of one surface are two objects, with numbers."""
    pointer = ctypes.c_void_p
    seeds = [f"--seed={x:.4f},{y:.4f},{z:.4f}" for x, y, z in map(scans.centre, scans.BALLS)]
    scans.run("segment", folder / "scan.nii", *seeds, "-o", folder / "both.3mf")
    model = library.get("createmodel", pointer)
    reader = library.get("model_queryreader", pointer, model, b"3mf")
    library("reader_readfromfileutf8", reader, str(folder / "both.3mf").encode())
    meshes = library.get("model_getmeshobjects", pointer, model)
    names = []
    while library.get("resourceiterator_movenext", ctypes.c_int, meshes).value:
        mesh = library.get("resourceiterator_getcurrent", pointer, meshes)
        assert library.get("meshobject_ismanifoldandoriented", ctypes.c_int, mesh).value
        names.append(library.text("object_getnameutf8", mesh))
    assert names == ["object 1 1", "object 1 2"], names


def pydicom(folder):
    import pydicom as reader

    for shear in (0.0, 0.3):
        series = folder / f"series{shear}"
        affine = scans.write_dicom(str(series), shear)
        words = ("-o", folder / "{object}.stl.dcm", "--mask", folder / "all.seg.dcm")
        scans.segment(series, *words, affine=affine)
        sources = {}
        for path in series.iterdir():
            source = reader.dcmread(path)
            sources[source.SOPInstanceUID] = source
        segmentation = reader.dcmread(folder / "all.seg.dcm")
        check_references(segmentation, sources)
        check_segmentation(segmentation, sources, affine)
        check_encapsulated(reader, folder, series, sources, affine)
        first = {name: (folder / name).read_bytes() for name in ("all.seg.dcm", "liver.stl.dcm")}
        scans.segment(series, *words, affine=affine)
        for name, content in first.items():
            assert (folder / name).read_bytes() == content, f"{name}: other bytes at the same time"
    said = f"pydicom {reader.__version__}"
    print(f"| .seg.dcm | {said} | every voxel of two segments, tilted gantry too | | frame of "
          "reference, position of each frame, names, colours, source images |")
    check_flaws(reader, folder)
    check_refusals(folder)


def check_flaws(reader, folder):
    """What many scans have and DICOM does not allow stays as it is; an object that is not found takes
    none of the others with it."""
    series = folder / "flawed"
    affine = scans.write_dicom(str(series))
    reader.config.settings.writing_validation_mode = reader.config.IGNORE
    reader.config.settings.reading_validation_mode = reader.config.IGNORE
    flaws = {"PatientAge": "45", "PatientWeight": "70kg", "PatientBirthDate": "anonymous", "PatientSex": "m",
             "StudyTime": "12:00:00", "StudyInstanceUID": "1.2.02.3", "FrameOfReferenceUID": "1.2.03.4",
             "StudyDescription": "head\\neck"}
    sources = {}
    for k, path in enumerate(sorted(series.iterdir())):
        data = reader.dcmread(path)
        for name, value in flaws.items():
            tag = reader.datadict.tag_for_keyword(name)
            data[tag] = reader.dataelem.RawDataElement(
                reader.tag.Tag(tag), reader.datadict.dictionary_VR(tag), len(value) + len(value) % 2,
                value.encode() + b" " * (len(value) % 2), 0, False, True)
        uid = f"1.2.03.5.{k}".encode()
        data[0x00080018] = reader.dataelem.RawDataElement(
            reader.tag.Tag(0x00080018), "UI", len(uid) + len(uid) % 2, uid + bytes(len(uid) % 2), 0, False, True)
        del data.SpecificCharacterSet  # beside a name that is not ASCII
        data.save_as(path)
        sources[uid.decode()] = data
    nothing = [f"{x:.6f}" for x in affine[:3, :3] @ (3, 3, 3) + affine[:3, 3]]
    words = [word for name in list(scans.BALLS)[:1] for word in
             ("--object", name, "--seed=" + ",".join(f"{x:.6f}" for x in scans.centre(name, affine)))]
    done = scans.run("segment", series, *words, "--object", "nothing", "--seed=" + ",".join(nothing), "-o",
                     folder / "{object}.stl", "--mask", folder / "flawed.seg.dcm", "--json", folder / "flawed.json",
                     check=False)
    assert done.returncode == 7, (done.returncode, done.stderr)
    assert (folder / "flawed.json").exists()
    made = reader.dcmread(folder / "flawed.seg.dcm")
    assert [s.SegmentLabel for s in made.SegmentSequence] == ["liver"]
    for name, value in flaws.items():
        found = reader.dcmread(folder / "flawed.seg.dcm").get_item(reader.datadict.tag_for_keyword(name)).value
        assert found.rstrip(b"\0 ").decode() == value, (name, found)
    for item in made.ReferencedSeriesSequence[0].ReferencedInstanceSequence:
        assert item.ReferencedSOPInstanceUID in sources
    for groups in made.PerFrameFunctionalGroupsSequence:
        item, = groups.DerivationImageSequence[0].SourceImageSequence
        assert item.ReferencedSOPInstanceUID in sources


def check_references(data, sources):
    """Patient, study and frame of reference of the series; a series and an instance of its own."""
    source = next(iter(sources.values()))
    for name in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID",
                 "StudyID", "StudyDate", "AccessionNumber", "FrameOfReferenceUID"):
        assert str(data[name].value) == str(source[name].value), name
    assert data.SeriesInstanceUID != source.SeriesInstanceUID
    assert data.SOPInstanceUID not in sources
    referenced, = data.ReferencedSeriesSequence
    assert referenced.SeriesInstanceUID == source.SeriesInstanceUID
    for item in referenced.ReferencedInstanceSequence:
        assert sources[item.ReferencedSOPInstanceUID].SOPClassUID == item.ReferencedSOPClassUID


def check_segmentation(data, sources, affine):
    assert data.Modality == "SEG" and data.SegmentationType == "BINARY"
    assert [s.SegmentLabel for s in data.SegmentSequence] == list(scans.BALLS)
    colours = [tuple(s.RecommendedDisplayCIELabValue) for s in data.SegmentSequence]
    assert len(set(colours)) == len(colours)
    bits = np.unpackbits(np.frombuffer(data.PixelData, np.uint8), bitorder="little")
    n = data.Rows * data.Columns
    frames = bits[: n * data.NumberOfFrames].reshape(-1, data.Rows, data.Columns)
    to_index = np.linalg.inv(np.diag([-1.0, -1, 1, 1]) @ affine)
    labels = np.zeros(scans.SHAPE, np.uint8)
    shared = data.SharedFunctionalGroupsSequence[0]
    measures = shared.PixelMeasuresSequence[0]
    source = next(iter(sources.values()))
    assert list(measures.PixelSpacing) == list(source.PixelSpacing)
    assert abs(measures.SpacingBetweenSlices - 1.4) < 1e-6  # across the slices, tilted or not
    orientation = shared.PlaneOrientationSequence[0].ImageOrientationPatient
    assert list(orientation) == list(source.ImageOrientationPatient)
    for frame, groups in zip(frames, data.PerFrameFunctionalGroupsSequence):
        position = groups.PlanePositionSequence[0].ImagePositionPatient
        k = (to_index @ [*map(float, position), 1])[:3]
        assert np.allclose(k, [0, 0, round(k[2])], atol=1e-5)
        label = groups.SegmentIdentificationSequence[0].ReferencedSegmentNumber
        assert groups.FrameContentSequence[0].DimensionIndexValues[0] == label
        labels[:, :, round(k[2])][frame.T == 1] = label
        item, = groups.DerivationImageSequence[0].SourceImageSequence
        source = sources[item.ReferencedSOPInstanceUID]
        assert list(source.ImagePositionPatient) == list(position)
    check_labels(labels, affine)


def check_encapsulated(reader, folder, series, sources, affine):
    data = reader.dcmread(folder / "liver.stl.dcm")
    check_references(data, sources)
    assert data.Modality == "M3D" and data.MIMETypeOfEncapsulatedDocument == "model/stl"
    assert data.MeasurementUnitsCodeSequence[0].CodeValue == "mm"
    assert data.DocumentTitle == "liver"
    scans.segment(series, "-o", folder / "{object}.stl", affine=affine)
    content = data.EncapsulatedDocument[: data.EncapsulatedDocumentLength]
    assert content == (folder / "liver.stl").read_bytes()
    if series.name == "series0.0":
        corners = np.frombuffer(content[84:], np.dtype("<12f4,<u2"))["f0"].reshape(-1, 4, 3)[:, 1:]
        points, triangles = merged(corners.reshape(-1, 3),
                                   np.arange(3 * len(corners)).reshape(-1, 3))
        scans.segment(series, "-o", folder / "{object}.obj")
        check(".stl.dcm", f"pydicom {reader.__version__}", "LPS mm", LPS, points, triangles,
              truth(folder / "liver.obj"), say="; frame of reference of the series")
        # RAS would land somewhere else: DICOM is LPS, whatever is asked for.
        scans.segment(series, "-o", folder / "{object}.stl.dcm", "--output-space", "ras")
        again = reader.dcmread(folder / "liver.stl.dcm")
        assert again.EncapsulatedDocument == data.EncapsulatedDocument


def check_refusals(folder):
    """Of a scan that is none of DICOM: one line, and no work before it."""
    scans.write_nifti(folder / "scan.nii")
    for words in (("-o", folder / "a.stl", "--mask", folder / "a.dcm"), ("-o", folder / "a.dcm")):
        done = scans.run("segment", folder / "scan.nii", "--seed=0,0,0", *words, check=False)
        assert done.returncode == 3 and "give the DICOM series" in done.stderr, done.stderr
        assert done.stderr.count("error") == 1 and not (folder / "a.dcm").exists()


def dciodvfy(folder):
    """dicom3tools' check of every attribute; it says "Error" of each fault."""
    import pydicom as reader

    series = folder / "series"
    scans.write_dicom(str(series))
    for path in series.iterdir():  # attributes that every object has, if only empty
        data = reader.dcmread(path)
        for name in ("PatientName", "PatientBirthDate", "PatientSex", "ReferringPhysicianName", "StudyID",
                     "AccessionNumber", "PositionReferenceIndicator", "StudyTime"):
            delattr(data, name)
        data.save_as(path)
    scans.segment(series, "-o", folder / "{object}.stl.dcm", "--mask", folder / "all.seg.dcm")
    for name in ("all.seg.dcm", "liver.stl.dcm"):
        done = subprocess.run(["dciodvfy", folder / name], capture_output=True, text=True)
        lines = (done.stdout + done.stderr).splitlines()
        faults = [line for line in lines if line.startswith("Error")]
        assert lines and not faults, "\n".join([name, *faults])
        print(f"| .{name.split('.', 1)[1]} | dciodvfy | | | {lines[0]}, no error |")


def is_there(reader):
    if reader in ("pydicom", "dciodvfy") and os.environ["SURFSEG_HAS_DCMTK"] != "1":
        return False
    if reader == "lib3mf":
        return ctypes.util.find_library("3MF")
    if reader == "dciodvfy":
        return shutil.which(reader) and importlib.util.find_spec("pydicom")
    return importlib.util.find_spec(reader)


def main(reader, folder=None):
    if not is_there(reader):
        print(f"skipped: {reader} is not here, or surfseg was built without DCMTK")
        return 77
    if folder:
        globals()[reader](pathlib.Path(folder))
        return 0
    with tempfile.TemporaryDirectory() as scratch:
        globals()[reader](pathlib.Path(scratch))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
