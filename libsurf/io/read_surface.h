// Triangle surfaces from STL, OBJ, PLY and VTP files.
#pragma once

#include <string>

#include "libsurf/base/types.h"
#include "libsurf/io/space.h"

namespace surf::io {

struct ReadOptions {
  /// Frame of a file whose header states none; LPS is what Slicer assumes, but VMTK and
  /// others write RAS without saying so.
  Space unstated_space = Space::kLps;
};

/// Reads the surface of a file, by the ending of `path`, into RAS mm: .stl (binary, ASCII),
/// .obj, .ply (ASCII, binary of both endians), .vtp. Not legacy .vtk: VTK 9.1's reader
/// crashes on truncated ones.
///
/// A statement SPACE=RAS or SPACE=LPS in the header is honoured (space.h); a file without
/// one is taken as the options say. Polygons with more than three vertices, taken for convex,
/// become a fan of triangles round their first vertex. The facets of STL become a surface
/// by welding vertices with equal coordinates; the other formats keep their points as they
/// are, unused ones too. Normals, colours and other data are dropped. The surface may be
/// open, non-manifold or intersecting: mesh/verify.h tells.
///
/// @throws InputError  missing, empty or truncated; not of its format; a number that is not
///                     one, or not finite; a face with fewer than three vertices or one
///                     that names a missing vertex; no faces; triangle strips. The
///                     message names the file and, for text, the line.
Triangles read_surface(const std::string& path, const ReadOptions& options = {});

/// True if `path` ends like a surface file that can be read.
bool is_readable_surface(const std::string& path);

/// The numbers of the points that a .ply or .vtp file holds by this name, such as deviation_mm, in
/// the order of read_surface().
/// @throws InputError  as read_surface(); the file has no such array, or not one number for each
///                     point
Eigen::VectorXd read_point_array(const std::string& path, const std::string& name);

}  // namespace surf::io
