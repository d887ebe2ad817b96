"""Two balls in an oblique scan whose place in the world is known, as NIfTI and as a DICOM series."""

import os
import subprocess

import numpy as np

SHAPE = (52, 44, 34)
# Voxel index to RAS mm: oblique, anisotropic, far from the origin, right-handed.
ROTATION = np.linalg.qr(np.array([[1.0, 0.2, -0.1], [-0.25, 1, 0.15], [0.1, -0.1, 1]]))[0]
ROTATION = ROTATION * np.sign(np.diag(ROTATION))
AFFINE = np.eye(4)
AFFINE[:3, :3] = ROTATION * [0.9, 1.1, 1.4]
AFFINE[:3, 3] = [31, -84, 417]
BALLS = {"liver": ((16, 21, 16), 9.0), "Tumor für Müller": ((38, 22, 17), 7.0)}


def centre(name, affine=AFFINE):
    """RAS mm."""
    return affine[:3, :3] @ BALLS[name][0] + affine[:3, 3]


def values(affine=AFFINE):
    """int16, indexed [i, j, k]: balls with an edge one voxel wide."""
    points = np.moveaxis(np.indices(SHAPE), 0, -1) @ affine[:3, :3].T
    out = np.full(SHAPE, 100.0)
    for index, radius in BALLS.values():
        distance = np.linalg.norm(points - affine[:3, :3] @ index, axis=-1) - radius
        out += 800 / (1 + np.exp(np.clip(4 * distance, -50, 50)))
    return np.rint(out).astype(np.int16)


def distances(points, name):
    """Of points in RAS mm to the surface of a ball [mm]."""
    return np.abs(np.linalg.norm(points - centre(name), axis=1) - BALLS[name][1])


def write_nifti(path):
    """By hand: 348 bytes of header, an sform."""
    header = np.zeros((), dtype=[
        ("size", "<i4"), ("a", "V36"), ("dim", "<i2", 8), ("b", "V14"), ("type", "<i2"),
        ("bits", "<i2"), ("c", "V2"), ("pixdim", "<f4", 8), ("offset", "<f4"), ("slope", "<f4"),
        ("inter", "<f4"), ("d", "V3"), ("units", "u1"), ("e", "V128"), ("qform", "<i2"),
        ("sform", "<i2"), ("quatern", "<f4", 6), ("srow", "<f4", (3, 4)), ("name", "V16"),
        ("magic", "S4")])
    header["size"], header["type"], header["bits"] = 348, 4, 16
    header["dim"] = [3, *SHAPE, 1, 1, 1, 1]
    header["pixdim"] = [1, *np.linalg.norm(AFFINE[:3, :3], axis=0), 1, 1, 1, 1]
    header["offset"], header["slope"], header["units"] = 352, 1, 2
    header["sform"], header["srow"], header["magic"] = 1, AFFINE[:3], b"n+1"
    with open(path, "wb") as file:
        file.write(header.tobytes() + bytes(4) + values().tobytes(order="F"))


def write_dicom(folder, shear=0.0):
    """A CT series by pydicom: the affine's first two axes along rows and columns; with `shear` mm
    from slice to slice along the columns, as a tilted gantry has it. Returns the affine (RAS)."""
    import pydicom
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

    affine = AFFINE.copy()
    affine[:3, 2] += shear * ROTATION[:, 1]
    lps = np.diag([-1.0, -1, 1, 1]) @ affine
    os.makedirs(folder, exist_ok=True)
    study, series, frame = (generate_uid(entropy_srcs=[folder, name]) for name in "sfo")
    array = values(affine)
    for k in range(SHAPE[2]):
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID = CTImageStorage
        meta.MediaStorageSOPInstanceUID = generate_uid(entropy_srcs=[folder, str(k)])
        meta.TransferSyntaxUID = ExplicitVRLittleEndian
        data = pydicom.Dataset()
        data.file_meta, data.is_little_endian, data.is_implicit_VR = meta, True, False
        data.SpecificCharacterSet = "ISO_IR 100"
        data.SOPClassUID, data.SOPInstanceUID = CTImageStorage, meta.MediaStorageSOPInstanceUID
        data.StudyDate, data.StudyTime, data.AccessionNumber = "20240102", "030405", "A17"
        data.Modality, data.Manufacturer, data.ReferringPhysicianName = "CT", "Phantom", ""
        data.PatientName, data.PatientID = "Müller^Jörg", "P-42"
        data.PatientBirthDate, data.PatientSex = "19600101", "O"
        data.StudyInstanceUID, data.SeriesInstanceUID = study, series
        data.StudyID, data.SeriesNumber, data.InstanceNumber = "S1", 7, k + 1
        data.FrameOfReferenceUID, data.PositionReferenceIndicator = frame, ""
        data.ImagePositionPatient = [f"{x:.9g}" for x in (lps @ [0, 0, k, 1])[:3]]
        data.ImageOrientationPatient = [f"{x:.9g}" for axis in range(2)
                                        for x in lps[:3, axis] / np.linalg.norm(lps[:3, axis])]
        data.PixelSpacing = [f"{np.linalg.norm(lps[:3, axis]):.9g}" for axis in (1, 0)]
        data.SliceThickness = "1.4"
        data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
        data.Rows, data.Columns = SHAPE[1], SHAPE[0]
        data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 16, 16, 15, 1
        data.RescaleIntercept, data.RescaleSlope = "0", "1"
        data.PixelData = np.ascontiguousarray(array[:, :, k].T).tobytes()
        # A slice's number says nothing of its place, as in many a folder.
        data.save_as(os.path.join(folder, f"{(7 * k) % SHAPE[2]:03}.dcm"),
                     write_like_original=False)
    return affine


def segment(scan, *words, affine=AFFINE):
    """Runs `surfseg segment` with both balls."""
    objects = []
    for name in BALLS:
        point = ",".join(f"{x:.6f}" for x in centre(name, affine))
        objects += ["--object", name, f"--seed={point}"]
    run("segment", scan, *objects, *words)


def run(*words, check=True):
    done = subprocess.run([os.environ["SURFSEG_PROGRAM"], *map(str, words)], capture_output=True,
                          text=True, env=dict(os.environ, SOURCE_DATE_EPOCH="1700000000"))
    if check and done.returncode != 0:
        raise AssertionError(f"{words}: exit code {done.returncode}: {done.stderr}")
    return done
