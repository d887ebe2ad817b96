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

double angle_deg(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  return std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
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

Points<3> angles_deg(const TriMesh& mesh) {
  Points<3> result(mesh.n_faces(), 3);
  for (const auto face : mesh.faces()) {
    const auto [a, b, c] = corners(mesh, face);
    result.row(face.idx()) << angle_deg(b - a, c - a), angle_deg(c - b, a - b),
        angle_deg(a - c, b - c);
  }
  return result;
}

double enclosed_volume(const TriMesh& mesh) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto vertex : mesh.vertices()) centre += mesh.point(vertex);
  centre /= static_cast<double>(mesh.n_vertices());
  double volume = 0;
  for (const auto face : mesh.faces()) {
    const auto [a, b, c] = corners(mesh, face);
    volume += (a - centre).dot((b - centre).cross(c - centre));
  }
  return volume / 6;
}

double surface_area(const TriMesh& mesh) {
  double area = 0;
  for (const auto face : mesh.faces()) {
    const auto [a, b, c] = corners(mesh, face);
    area += area_normal(a, b, c).norm();
  }
  return area / 2;
}

double cos_deg(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

}  // namespace surf::mesh
