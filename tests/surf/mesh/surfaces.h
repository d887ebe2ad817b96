// Closed surfaces for the tests of libsurf/mesh.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/triangle_mesh.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {

/// Torus round the z axis: n_around rings of n_across vertices, outward.
inline Triangles torus(double radius, double tube, int n_around, int n_across) {
  Triangles result{Points<3>(n_around * n_across, 3), Elements<3>(2 * n_around * n_across, 3)};
  const auto index = [&](int i, int j) { return i % n_around * n_across + j % n_across; };
  for (int i = 0; i < n_around; ++i)
    for (int j = 0; j < n_across; ++j) {
      const double u = 2 * std::numbers::pi * i / n_around, v = 2 * std::numbers::pi * j / n_across;
      const double r = radius + tube * std::cos(v);
      result.points.row(index(i, j)) << r * std::cos(u), r * std::sin(u), tube * std::sin(v);
      const int row = 2 * index(i, j);
      result.elements.row(row) << index(i, j), index(i + 1, j), index(i + 1, j + 1);
      result.elements.row(row + 1) << index(i, j), index(i + 1, j + 1), index(i, j + 1);
    }
  return result;
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

/// Smallest angle of the surface [degrees].
inline double min_angle_deg(const TriMesh& mesh) { return angles_deg(mesh).minCoeff(); }

/// Part of the triangles whose smallest angle is at least `degrees`.
inline double share_of_angles_above(const TriMesh& mesh, double degrees) {
  const Points<3> angles = angles_deg(mesh);
  return (angles.rowwise().minCoeff().array() >= degrees).cast<double>().mean();
}

inline double longest_edge(const TriMesh& mesh) {
  double longest = 0;
  for (const auto edge : mesh.edges()) longest = std::max(longest, mesh.calc_edge_length(edge));
  return longest;
}

}  // namespace surf::mesh
