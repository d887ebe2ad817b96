// Matrices of the trilinear functions on the nodes of a grid, restricted to a domain that cuts its
// cells. Private to volume/*.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "libsurf/volume/cut_cells.h"

namespace surf::volume {

/// Values at the nodes of a grid, i fastest, with one more node on every side that is 0.
struct PaddedGrid {
  std::array<int, 3> size;  ///< nodes

  std::array<std::size_t, 3> strides() const {
    return {1, std::size_t(size[0]) + 2, (std::size_t(size[0]) + 2) * (size[1] + 2)};
  }
  std::size_t n_values() const { return strides()[2] * (size[2] + 2); }
  std::size_t at(int i, int j, int k) const {
    const auto stride = strides();
    return (k + 1) * stride[2] + (j + 1) * stride[1] + (i + 1);
  }
  /// Indices i and j of a value.
  std::array<int, 2> place_in_slab(std::size_t value) const {
    const std::size_t stride = strides()[1];
    return {int(value % stride) - 1, int(value / stride % (size[1] + 2)) - 1};
  }
};

using Values = std::vector<double>;

/// Nodes along i that follow each other.
struct NodeRange {
  std::size_t begin;
  int n;
};

/// mass * <u, v> + stiffness * <grad u, grad v> over a domain, for trilinear u, v. Symmetric,
/// positive semi-definite; definite on the active nodes, those whose function is not 0 on the
/// domain, if mass > 0. Nodes off the surface share one of 27 stencils, by whether they lie on the
/// grid's sides; the rest have rows of their own.
///
/// Products are computed slab by slab, sums in the slabs' order: the same for any number of
/// threads. Values of nodes that are not active have to be 0, and stay so.
class CutMatrix {
 public:
  /// @param index_to_world  of the grid's indices
  CutMatrix(const DomainCells& cells, const Eigen::Matrix3d& index_to_world, double mass,
            double stiffness);

  const PaddedGrid& box() const { return box_; }
  /// Sum of |entries| of each row, inverted: with it Jacobi's method contracts on every domain,
  /// however small the parts of the cells. 0 at nodes that are not active.
  const Values& inverse_scale() const { return inverse_scale_; }
  bool is_active(std::size_t node) const { return inverse_scale_[node] > 0; }
  /// Ranges that cover the active nodes of slab k.
  std::span<const NodeRange> active(int k) const;

  /// y = A x
  void multiply(const Values& x, Values& y) const;
  /// y = b - A x
  void residual(const Values& b, const Values& x, Values& y) const;

 private:
  using Row = std::array<double, 27>;
  struct Run {
    NodeRange nodes;
    int stencil;
  };
  struct Slab {
    std::vector<Run> runs;
    std::vector<std::size_t> cut_nodes;
    std::vector<Row> cut_rows;
    std::vector<NodeRange> active;
  };

  void make_stencils(const fem::CellMatrix& full);
  void fill_slab(const DomainCells& cells, std::span<const fem::CellMatrix> cut,
                 const fem::CellMatrix& full, int k);
  Row row_of(const DomainCells& cells, std::span<const fem::CellMatrix> cut,
             const fem::CellMatrix& full, const std::array<int, 3>& node) const;
  void multiply_slab(const Slab& slab, const double* x, double* y) const;

  PaddedGrid box_;
  std::array<std::ptrdiff_t, 27> offsets_;
  std::array<Row, 27> stencils_;
  std::array<double, 27> stencil_scales_;
  std::vector<Slab> slabs_;
  Values inverse_scale_;
};

}  // namespace surf::volume
