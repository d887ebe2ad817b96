#include "libsurf/mesh/triangle_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surf::mesh {
namespace {

struct Corners {
  const Eigen::Vector3d &a, &b, &c;
};

Corners corners(const TriMesh& mesh, OpenMesh::FaceHandle face) {
  const auto first = mesh.halfedge_handle(face);
  const auto second = mesh.next_halfedge_handle(first);
  return {mesh.point(mesh.from_vertex_handle(first)), mesh.point(mesh.to_vertex_handle(first)),
          mesh.point(mesh.to_vertex_handle(second))};
}

}  // namespace

AngleCosines angle_cosines(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, bc = c - b, ca = a - c;
  const double length_ab = ab.norm(), length_bc = bc.norm(), length_ca = ca.norm();
  if (!(length_ab * length_bc * length_ca > 0)) return {-1, 1};
  const double at_a = -ca.dot(ab) / (length_ca * length_ab);
  const double at_b = -ab.dot(bc) / (length_ab * length_bc);
  const double at_c = -bc.dot(ca) / (length_bc * length_ca);
  return {std::min({at_a, at_b, at_c}), std::max({at_a, at_b, at_c})};
}

AngleCosines angle_cosines(const TriMesh& mesh, OpenMesh::FaceHandle face) {
  const auto [a, b, c] = corners(mesh, face);
  return angle_cosines(a, b, c);
}

double cos_deg(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

}  // namespace surf::mesh
