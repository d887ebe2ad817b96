// The plan of one surgery: which triangles of a surface go, and what takes their place. Private to
// surgery.
#pragma once

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

/// A surface and who is next to whom.
struct ConnectedSurface {
  Triangles triangles;
  Stars stars;
  /// The triangle across the side of each corner and the next one.
  Elements<3> across;

  explicit ConnectedSurface(const TriMesh& mesh);

  Vector<3> corner(int triangle, int i) const {
    return triangles.points.row(triangles.elements(triangle, i));
  }
  Vector<3> centroid(int triangle) const {
    return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
  }
};

/// What takes the place of some triangles.
struct Patch {
  std::vector<int> removed;                   ///< triangles, ascending
  std::vector<Vector<3>> points;              ///< new vertices
  std::vector<std::array<int, 3>> triangles;  ///< vertices of the surface, then the new ones
};

/// Longest edge of faces near an event, in units of the resolution: larger ones have to be bisected
/// before.
constexpr double kLongestEdgeAtEvent = 2.5;

struct RegionRequest {
  std::vector<int> events;  ///< triangles
  std::vector<int> others;  ///< triangles that belong to the region, wherever they are
  double reach_mm = 0;      ///< along the surface from the events; infinite: the whole components
};

struct RegionPlan {
  enum class State { kFits, kFails, kWantsMore };
  State state = State::kFails;
  Patch patch;
  /// Events of other regions that a phantom part of this one borders on, after kWantsMore; what
  /// else passes through the cells, after kFails.
  std::vector<int> wanted;
};

/// Plans the patch for a region of a surface, see operate(). That it does not intersect the rest is
/// not looked at.
/// @param is_event       one flag per triangle: events of this region and others
/// @param resolution_mm  spacing of the grid
RegionPlan plan_region(const ConnectedSurface& surface, const std::vector<char>& is_event,
                       const RegionRequest& request, double resolution_mm);

}  // namespace surf::mesh
