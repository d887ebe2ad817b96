// Closed surfaces for the tests of libsurf/mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/triangle_mesh.h"
#include "libsurf/mesh/triangle_shape.h"
#include "tests/surf/torus.h"

namespace surf::mesh {

/// Torus round the z axis: n_around rings of n_across vertices, outward.
inline Triangles torus(double radius, double tube, int n_around, int n_across) {
  return test::torus_triangles(radius, tube, n_around, n_across);
}

/// Ball, ellipsoid, box or torus with edges of about 0.3, size about 1.
inline Triangles some_surface(int kind) {
  const Eigen::Vector3d center(0.1, -0.2, 0.3);
  const Eigen::Vector3d axes(1, 0.5, 1.5);
  switch (kind % 4) {
    case 0:
      return ball(center, 1, 0.35);
    case 1:
      return ellipsoid(center, axes.asDiagonal(), 0.4);
    case 2:
      return box(center, center + Eigen::Vector3d(1, 0.7, 1.3), 0.3);
    default:
      return torus(1, 0.4, 16, 8);
  }
}

/// A smooth displacement field of the given amplitude.
class WavyField {
 public:
  WavyField(std::mt19937& random, double amplitude) : amplitude_(amplitude) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (auto& row : frequency_.reshaped()) row = 3 * uniform(random);
    for (auto& phase : phase_) phase = std::numbers::pi * uniform(random);
  }

  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const {
    return amplitude_ * ((frequency_ * x + phase_).array().sin()).matrix();
  }

 private:
  double amplitude_;
  Eigen::Matrix3d frequency_;
  Eigen::Vector3d phase_;
};

inline void move(TriMesh& mesh, const WavyField& field) {
  for (const auto vertex : mesh.vertices())
    mesh.set_point(vertex, mesh.point(vertex) + field(mesh.point(vertex)));
}

/// Angles at the three vertices of each face [degrees].
inline Points<3> angles_deg(const TriMesh& mesh) {
  const Triangles surface = to_triangles(mesh);
  Points<3> out(surface.elements.rows(), 3);
  for (Eigen::Index t = 0; t < out.rows(); ++t) {
    const auto corner = [&](int i) {
      return Vector<3>(surface.points.row(surface.elements(t, i)));
    };
    out.row(t) = angles_deg(corner(0), corner(1), corner(2)).transpose();
  }
  return out;
}

inline double enclosed_volume(const TriMesh& mesh) { return volume_mm3(to_triangles(mesh)); }
inline double surface_area(const TriMesh& mesh) { return area_mm2(to_triangles(mesh)); }

/// Smallest angle of the surface [degrees].
inline double min_angle_deg(const TriMesh& mesh) { return angles_deg(mesh).minCoeff(); }

/// Part of the triangles whose smallest angle is at least `degrees`.
inline double share_of_angles_above(const TriMesh& mesh, double degrees) {
  const Points<3> angles = angles_deg(mesh);
  return (angles.rowwise().minCoeff().array() >= degrees).cast<double>().mean();
}

inline std::vector<FaceHandle> random_faces(const TriMesh& mesh, double share,
                                            std::mt19937& random) {
  std::bernoulli_distribution is_marked(share);
  std::vector<FaceHandle> marked;
  for (const auto face : mesh.faces())
    if (is_marked(random)) marked.push_back(face);
  std::shuffle(marked.begin(), marked.end(), random);
  return marked;
}

inline std::vector<FaceHandle> all_faces(const TriMesh& mesh) {
  std::vector<FaceHandle> result;
  for (const auto face : mesh.faces()) result.push_back(face);
  return result;
}

inline double longest_edge(const TriMesh& mesh) {
  double longest = 0;
  for (const auto edge : mesh.edges()) longest = std::max(longest, mesh.calc_edge_length(edge));
  return longest;
}

/// Bisects faces until no edge is longer. Returns the number of new vertices.
inline int refine_long_edges(TriMesh& mesh, double max_length, const BisectionHook& hook = {}) {
  for (int n_new_vertices = 0;;) {
    std::vector<FaceHandle> marked;
    for (const auto face : mesh.faces())
      if (std::any_of(mesh.cfe_begin(face), mesh.cfe_end(face),
                      [&](const auto edge) { return mesh.calc_edge_length(edge) > max_length; }))
        marked.push_back(face);
    if (marked.empty()) return n_new_vertices;
    n_new_vertices += bisect(mesh, marked, hook);
  }
}

}  // namespace surf::mesh
