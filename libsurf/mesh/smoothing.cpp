#include "libsurf/mesh/smoothing.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;
using OpenMesh::VertexHandle;

/// Neighbours of a vertex in cyclic order: triangle k of the star is (z, link[k], link[k + 1]).
using Link = std::vector<Vector3d>;

void collect_link(const TriMesh& mesh, VertexHandle vertex, Link& link) {
  link.clear();
  for (const VertexHandle neighbour : mesh.vv_ccw_range(vertex))
    link.push_back(mesh.point(neighbour));
}

const Vector3d& after(const Link& link, std::size_t k) {
  return link[k + 1 < link.size() ? k + 1 : 0];
}

/// z' of Algorithm 4, empty if the star has no normal.
std::optional<Vector3d> target(const Vector3d& z, const Link& link) {
  constexpr double kFolded = 0.01;
  Vector3d normal = Vector3d::Zero();    // 6 n
  Vector3d weighted = Vector3d::Zero();  // sum of 2 |T| (centroid - z)
  double area = 0;                       // sum of 2 |T|
  for (std::size_t k = 0; k < link.size(); ++k) {
    const Vector3d a = link[k] - z, b = after(link, k) - z;
    const Vector3d cross = a.cross(b);
    const double weight = cross.norm();
    normal += cross;
    weighted += weight * (a + b) / 3;
    area += weight;
  }
  const double norm = normal.norm();
  if (!(norm > kFolded * area)) return std::nullopt;
  const Vector3d unit = normal / norm;
  const Vector3d shift = weighted / area;
  return z + (shift - unit.dot(shift) * unit);
}

/// Largest cosine of an angle in the star.
double sharpest(const Vector3d& z, const Link& link) {
  double cosine = -1;
  for (std::size_t k = 0; k < link.size(); ++k)
    cosine = std::max(cosine, angle_cosines(z, link[k], after(link, k)).sharpest);
  return cosine;
}

bool turns_a_triangle(const Vector3d& z, const Vector3d& moved, const Link& link) {
  for (std::size_t k = 0; k < link.size(); ++k) {
    const Vector3d before = area_normal(z, link[k], after(link, k));
    const Vector3d now = area_normal(moved, link[k], after(link, k));
    if (!(before.dot(now) > 0)) return true;
  }
  return false;
}

bool is_acceptable(const Vector3d& z, const Vector3d& moved, const Link& link, double cos_bound) {
  if (turns_a_triangle(z, moved, link)) return false;
  const double now = sharpest(moved, link);
  return now <= cos_bound || now <= sharpest(z, link);
}

}  // namespace

SmoothingReport smooth(TriMesh& mesh, const SmoothingOptions& options) {
  const double cos_bound = cos_deg(options.min_angle_deg);
  SmoothingReport report;
  Link link;
  for (int sweep = 0; sweep < options.n_sweeps; ++sweep)
    for (const VertexHandle vertex : mesh.vertices()) {
      const Vector3d z = mesh.point(vertex);
      collect_link(mesh, vertex, link);
      const std::optional<Vector3d> moved = target(z, link);
      if (moved && is_acceptable(z, *moved, link, cos_bound)) {
        mesh.set_point(vertex, *moved);
        ++report.n_moved;
      } else {
        ++report.n_rejected;
      }
    }
  return report;
}

}  // namespace surf::mesh
