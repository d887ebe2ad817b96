// VTK's polygonal data as surfseg reads and writes them: .vtp; in the library surf_vtk.
#pragma once

#include <string>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/io/detail/surface_formats.h"
#include "libsurf/io/space.h"
#include "libsurf/io/write_surface.h"

namespace surf::io {

/// Triangles, or closed lines.
struct VtpContent {
  Triangles surface;                    ///< the points of both
  std::vector<PointArray> arrays = {};  ///< numbers of the points
  bool is_of_lines = false;
  std::vector<std::vector<int>> rings = {};
  std::vector<int> slices = {};  ///< of each ring, as the cells' numbers "slice"; or none
};

extern "C" {
/// As the readers of surface_formats.h.
/// @throws InputError
extern FileSurface (*const surf_read_vtp)(const std::string& path, const std::string& content);
/// The file's bytes: doubles, binary, compressed, with the field data SPACE.
extern std::string (*const surf_vtp_bytes)(const VtpContent& content, Space space);
}

}  // namespace surf::io
