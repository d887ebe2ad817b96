// Sets of cells of a cubic grid, and which of them triangles meet. Private to surgery.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/mesh/detail/winding_grid.h"

namespace surf::mesh {

/// Flags of the cells of a grid; cell (i, j, k) has the number of its first node.
class GridCells {
 public:
  explicit GridCells(const CubicGrid& grid) : grid_(grid), flags_(grid.n_nodes(), 0) {}

  bool operator()(int i, int j, int k) const { return flags_[grid_.node(i, j, k)] != 0; }
  void set(int i, int j, int k) { flags_[grid_.node(i, j, k)] = 1; }

  /// Calls visit(i, j, k) for cells that the triangle meets, and by chance a few next to it, until
  /// one returns true.
  template <class Visit>
  bool any_at(const Triangles& surface, int triangle, const Visit& visit) const {
    Eigen::Matrix3d index;
    for (int i = 0; i < 3; ++i)
      index.col(i) =
          (surface.points.row(surface.elements(triangle, i)).transpose() - grid_.origin) /
          grid_.spacing;
    Eigen::Array3d low = index.rowwise().minCoeff().array().floor(),
                   high = index.rowwise().maxCoeff().array().floor();
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(low[axis], 0.0);
      high[axis] = std::min(high[axis], double(grid_.size[axis] - 2));
      if (low[axis] > high[axis]) return false;
    }
    const Eigen::Vector3d normal = (index.col(1) - index.col(0))
                                       .cross(Eigen::Vector3d(index.col(2) - index.col(0)))
                                       .normalized();
    const double reach = normal.cwiseAbs().sum() / 2 + 1e-6;  // of a cell from its middle
    for (int k = int(low[2]); k <= int(high[2]); ++k)
      for (int j = int(low[1]); j <= int(high[1]); ++j)
        for (int i = int(low[0]); i <= int(high[0]); ++i) {
          const Eigen::Vector3d middle = Eigen::Vector3d(i, j, k).array() + 0.5;
          if (std::abs(normal.dot(middle - index.col(0))) > reach) continue;
          if (visit(i, j, k)) return true;
        }
    return false;
  }

  void set_at(const Triangles& surface, int triangle) {
    any_at(surface, triangle, [this](int i, int j, int k) {
      set(i, j, k);
      return false;
    });
  }

  bool is_any_at(const Triangles& surface, int triangle) const {
    return any_at(surface, triangle, *this);
  }

  /// Sets all cells next to set ones, corners included, n times. Cells at the border stay as they
  /// are.
  void dilate(int n) {
    for (int round = 0; round < n; ++round)
      for (int axis = 0; axis < 3; ++axis) dilate_along(axis);
  }

  void add(const GridCells& others) {
    for (std::size_t at = 0; at < flags_.size(); ++at) flags_[at] |= others.flags_[at];
  }

  void subtract(const GridCells& others) {
    for (std::size_t at = 0; at < flags_.size(); ++at)
      if (others.flags_[at]) flags_[at] = 0;
  }

  template <class Visit>
  void for_each(const Visit& visit) const {
    for (int k = 0; k + 1 < grid_.size[2]; ++k)
      for (int j = 0; j + 1 < grid_.size[1]; ++j)
        for (int i = 0; i + 1 < grid_.size[0]; ++i)
          if ((*this)(i, j, k)) visit(i, j, k);
  }

 private:
  void dilate_along(int axis) {
    const std::size_t stride = axis == 0   ? 1
                               : axis == 1 ? std::size_t(grid_.size[0])
                                           : std::size_t(grid_.size[0]) * grid_.size[1];
    const std::vector<std::uint8_t> before = flags_;
    for (std::size_t at = stride; at + stride < flags_.size(); ++at)
      flags_[at] |= before[at - stride] | before[at + stride];
  }

  const CubicGrid& grid_;
  std::vector<std::uint8_t> flags_;
};

}  // namespace surf::mesh
