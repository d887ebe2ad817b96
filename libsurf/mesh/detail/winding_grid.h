// Where a surface's winding number is at least one, on a grid of cubic cells.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Nodes of a grid of cubic cells; cell (i, j, k) lies between the nodes (i, j, k) and
/// (i + 1, j + 1, k + 1).
struct CubicGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< node (0, 0, 0) [mm]
  double spacing = 1;                                ///< [mm]
  std::array<int, 3> size = {0, 0, 0};               ///< nodes along each axis

  std::size_t n_nodes() const { return std::size_t(size[0]) * size[1] * size[2]; }
  std::size_t node(int i, int j, int k) const {
    return (std::size_t(k) * size[1] + j) * size[0] + i;
  }
  Eigen::Vector3d position(int i, int j, int k) const {
    return origin + spacing * Eigen::Vector3d(i, j, k);
  }
  /// Round all nodes, larger by what rounding of indices may come to.
  Eigen::AlignedBox3d box() const {
    const Eigen::Vector3d slack = Eigen::Vector3d::Constant(1e-6 * spacing);
    return {origin - slack, position(size[0] - 1, size[1] - 1, size[2] - 1) + slack};
  }
};

/// Samples of the domain of a closed, oriented surface that may intersect itself, have shells in
/// shells and inverted parts: the points round which it winds at least once. What is inverted is
/// outside (winding number <= -1), what is covered twice is inside once.
class WindingGrid {
 public:
  /// Crossings of all grid lines with the surface: O(triangles + crossings + nodes).
  /// @pre  indices name points
  WindingGrid(const Points<3>& points, const Elements<3>& elements, const CubicGrid& grid);

  const CubicGrid& grid() const { return grid_; }

  /// One flag per node; winding numbers from crossings with lines along the first axis, exact but
  /// for nodes within rounding of the surface.
  const std::vector<std::uint8_t>& inside() const { return inside_; }

  /// Where the line along an axis passes the domain's boundary between a node and the next one, as
  /// a share of the spacing in (0, 1); 0 if it does not, or rounding says otherwise than at the
  /// nodes. Of several places the one in the middle.
  double crossing(int axis, const std::array<int, 3>& node) const;

 private:
  /// Places along the lines of an axis where the winding number passes 1.
  struct Lines {
    std::vector<std::uint32_t> first;  // of each line in places, and the end
    std::vector<double> places;        // in units of the spacing, ascending in each line
  };
  std::size_t line(int axis, const std::array<int, 3>& node) const;

  CubicGrid grid_;
  std::vector<std::uint8_t> inside_;
  std::array<Lines, 3> lines_;
};

/// Winding numbers on both sides of a triangle of a closed, oriented surface.
struct SidesOfTriangle {
  int inner, outer;  ///< behind its normal, before it: inner = outer + 1
};

/// By the crossings of the line through its centroid along the axis that is steepest to it. O(n).
SidesOfTriangle winding_beside(const Points<3>& points, const Elements<3>& elements, int triangle);

}  // namespace surf::mesh
