#include "libsurf/mesh/angle_width.h"

#include <vector>

#include "libsurf/mesh/smoothing.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

std::vector<OpenMesh::FaceHandle> wide_faces(const TriMesh& mesh, double max_angle_deg) {
  const double cos_bound = cos_deg(max_angle_deg);
  std::vector<OpenMesh::FaceHandle> wide;
  for (const auto face : mesh.faces())
    if (angle_cosines(mesh, face).widest < cos_bound) wide.push_back(face);
  return wide;
}

}  // namespace

AngleWidthReport control_angle_width(TriMesh& mesh, const AngleWidthOptions& options,
                                     const BisectionHook& hook) {
  AngleWidthReport report;
  auto wide = wide_faces(mesh, options.max_angle_deg);
  while (!wide.empty() && report.n_rounds < options.max_rounds) {
    report.n_new_vertices += bisect_at_longest_edges(mesh, wide, hook);
    smooth(mesh, {.n_sweeps = options.n_smoothing_sweeps});
    ++report.n_rounds;
    wide = wide_faces(mesh, options.max_angle_deg);
  }
  report.n_wide = static_cast<int>(wide.size());
  return report;
}

}  // namespace surf::mesh
