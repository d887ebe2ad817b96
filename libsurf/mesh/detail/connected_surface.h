// A closed surface in arrays and who is next to whom. Private to surgery.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// The triangles of each vertex.
class Stars {
 public:
  Stars(const Elements<3>& elements, Eigen::Index n_vertices)
      : first_(n_vertices + 1, 0), triangles_(elements.size()) {
    for (const int vertex : elements.reshaped()) ++first_[vertex + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (int t = 0; t < elements.rows(); ++t)
      for (int i = 0; i < 3; ++i) triangles_[next[elements(t, i)]++] = t;
  }
  std::span<const int> operator[](int vertex) const {
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<int> first_, triangles_;
};

/// Least and largest coordinates, not smaller than what they hold.
using FloatBox = std::array<std::array<float, 2>, 3>;

/// A surface, who is next to whom, and where.
struct ConnectedSurface {
  Triangles triangles;
  Stars stars;
  /// The triangle across the side of each corner and the next one.
  Elements<3> across;
  std::vector<FloatBox> boxes;  ///< of the triangles

  explicit ConnectedSurface(const TriMesh& mesh);

  /// Triangles whose boxes meet another along this many axes at least, and maybe some next to it.
  std::vector<int> triangles_near(const Eigen::AlignedBox3d& box, int n_axes = 3) const;

  int n_triangles() const { return static_cast<int>(triangles.elements.rows()); }
  int n_vertices() const { return static_cast<int>(triangles.points.rows()); }
  int vertex(int triangle, int i) const { return triangles.elements(triangle, i); }

  Vector<3> corner(int triangle, int i) const {
    return triangles.points.row(triangles.elements(triangle, i));
  }
  Vector<3> centroid(int triangle) const {
    return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
  }
};

/// Some of the triangles of a surface: one flag per triangle.
using TriangleFlags = std::vector<char>;

}  // namespace surf::mesh
