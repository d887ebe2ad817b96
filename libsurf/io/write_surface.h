// Triangle surfaces to STL, OBJ, PLY, VTP, GIFTI, GLB, 3MF and DICOM files that land on the volume
// they came from.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/io/space.h"
#include "libsurf/volume/dicom_origin.h"

namespace surf::io {

/// A number of each point, by a name without blanks that ends in its unit if it has one.
struct PointArray {
  std::string name;
  Eigen::VectorXd values;  ///< (n)
};

struct WriteOptions {
  /// Frame of the coordinates in the file. Every format states it as Slicer reads it:
  /// SPACE=LPS in STL's 80-byte header, in a comment of OBJ and PLY, in the field data of VTP, in
  /// the extras of GLB, in the description of 3MF. GIFTI is RAS and DICOM is LPS by their own
  /// rules.
  Space space = Space::kLps;
  /// For PLY (properties of the vertices, float32), VTP (point data, float64), GLB (attributes,
  /// float32) and GIFTI (NAME.shape.gii beside NAME.surf.gii, float32); the others have no place
  /// for them.
  std::vector<PointArray> arrays = {};
  /// sRGB, of the material of GLB, 3MF and OBJ (NAME.mtl beside NAME.obj).
  std::optional<std::array<std::uint8_t, 3>> colour = {};
  /// Of the object: 3MF, OBJ, GLB, DICOM.
  std::string name = {};
  /// Of the volume that the surface was found in: for DICOM, see volume::check_dicom_output().
  std::shared_ptr<const volume::DicomOrigin> dicom = {};
};

/// Writes the surface (RAS mm) by the ending of `path`, whole or not at all: .stl and .ply
/// (binary, little endian), .obj (text), .vtp (binary, compressed), .gii (GIFTI, compressed), .glb
/// (binary glTF 2.0), .3mf (an object for each solid), .dcm (DICOM Encapsulated STL). The same
/// surface gives the same bytes; for DICOM see volume::write_label_map().
///
/// VTP holds float64, the others float32: see rounded_to_file.
///
/// @throws UsageError   another ending
/// @throws InputError   .dcm without options.dicom
/// @throws OutputError  the folder is missing or not writable, or the disk is full
/// @throws InvalidMesh  an element names a missing point, or a coordinate is not finite as
///                      the file's float; an array has another length than the points
void write_surface(const std::string& path, const Triangles& surface,
                   const WriteOptions& options = {});

/// The surface exactly as a file with this ending (".stl", ...) will hold it, in RAS mm:
/// coordinates rounded to float32, for OBJ too (more digits would be legal there, but its
/// readers keep floats), untouched for VTP. Rounding can make triangles
/// intersect, so the surface to verify is this one. STL has no shared vertices: points
/// that round to the same floats become one when it is read.
///
/// @throws UsageError  another ending
Triangles rounded_to_file(const Triangles& surface, const std::string& extension);

/// True if `path` ends like a surface file that can be written.
bool is_writable_surface(const std::string& path);

/// The endings of the files that can be written, the most usual first, as names are best chosen:
/// ".stl", ..., ".surf.gii", ".stl.dcm".
std::vector<std::string> surface_endings();

/// The same for messages: ".stl, .obj, ... or .dcm".
std::string writable_surfaces();

/// The file that write_surface() may write beside `path`: NAME.shape.gii of a GIFTI file, NAME.mtl
/// of an OBJ file, with _ for each blank of NAME; "" if there is none. One that it wrote for an
/// earlier surface is removed if there is nothing to write into it now.
std::string file_beside(const std::string& path);

}  // namespace surf::io
