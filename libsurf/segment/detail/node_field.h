// Fields from values at the nodes of a grid, in an image or a volume.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/base/index_box.h"

namespace surf::segment {

/// Nodes at integer indices 0 <= index < size, first index fastest, and where they are.
template <int Dim>
struct NodeGrid {
  std::array<int, Dim> size;
  Eigen::Transform<double, Dim, Eigen::Affine> node_to_world;  ///< [mm]

  std::size_t n() const {
    std::size_t out = 1;
    for (const int s : size) out *= std::size_t(s);
    return out;
  }
  /// Of the nodes first <= node < end, (end - first, Dim) [mm].
  Points<Dim> positions(std::size_t first, std::size_t end) const;
  /// size, and 1 for what a plane lacks: the form that grids in space have.
  std::array<int, 3> size_in_space() const {
    if constexpr (Dim == 3)
      return size;
    else
      return {size[0], size[1], 1};
  }
};

/// A field at one point: as many derivatives as were asked for.
template <int Dim>
struct PointSample {
  double value;
  Vector<Dim> gradient;                     ///< [1/mm]
  Eigen::Matrix<double, Dim, Dim> hessian;  ///< [1/mm^2]
};

/// The C^2 cubic B-spline approximants of N lists of values at the same nodes (see
/// volume::TiledField), continued constantly beyond the outermost nodes. The weights at a point are
/// found once for all of them.
template <int Dim, std::size_t N>
class NodeFields {
 public:
  /// @param values  of each field, one for each node
  NodeFields(const NodeGrid<Dim>& grid, std::array<std::vector<float>, N> values);

  /// @param x  [mm]
  std::array<PointSample<Dim>, N> sample(const Vector<Dim>& x, Derivatives order) const;

 private:
  // See volume/detail/spline.h.
  std::array<PointSample<Dim>, N> sample_once(const Vector<Dim>& x, Derivatives order) const;
  std::array<PointSample<Dim>, N> sample_by_avx2(const Vector<Dim>& x, Derivatives order) const;

  NodeGrid<Dim> grid_;
  Eigen::Transform<double, Dim, Eigen::Affine> world_to_node_;
  std::array<std::vector<float>, N> values_;
};

/// The values blurred along each axis by three boxes that together are about a Gaussian of this
/// deviation [nodes]; beyond the grid there is nothing (0). O(nodes).
void blur(const std::array<int, 3>& size, double deviation, std::vector<float>& values);
/// The same at the wanted nodes alone, in about half the time; elsewhere the values are lost.
void blur(const std::array<int, 3>& size, double deviation, const IndexBox<3>& wanted,
          std::vector<float>& values);

}  // namespace surf::segment
