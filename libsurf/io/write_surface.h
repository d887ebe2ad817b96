// Triangle surfaces to STL, OBJ, PLY, VTP, GIFTI and GLB files that land on the volume they came
// from.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/io/space.h"

namespace surf::io {

/// A number of each point, by a name without blanks that ends in its unit if it has one.
struct PointArray {
  std::string name;
  Eigen::VectorXd values;  ///< (n)
};

struct WriteOptions {
  /// Frame of the coordinates in the file. Every format states it as Slicer reads it:
  /// SPACE=LPS in STL's 80-byte header, in a comment of OBJ and PLY, in the field data of VTP, in
  /// the extras of GLB. GIFTI is RAS by its own rules.
  Space space = Space::kLps;
  /// For PLY (properties of the vertices, float32), VTP (point data, float64), GLB (attributes,
  /// float32) and GIFTI (NAME.shape.gii beside NAME.surf.gii, float32); STL and OBJ have no place
  /// for them.
  std::vector<PointArray> arrays = {};
  /// sRGB, of GLB's material.
  std::optional<std::array<std::uint8_t, 3>> colour = {};
};

/// Writes the surface (RAS mm) by the ending of `path`, whole or not at all: .stl and .ply
/// (binary, little endian), .obj (text), .vtp (binary, compressed), .gii (GIFTI, compressed), .glb
/// (binary glTF 2.0). The same surface gives the same bytes.
///
/// VTP holds float64, the others float32: see rounded_to_file.
///
/// @throws UsageError   another ending
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

/// The endings of the files that can be written, for messages: ".stl, .obj, ... or .glb".
std::string writable_surfaces();

}  // namespace surf::io
