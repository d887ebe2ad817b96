// Fields on a volume's grid, computed tile by tile where they are asked for.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <memory>

#include "libsurf/base/field.h"

namespace surf::volume {

/// Nodes at integer indices 0 <= (i, j, k) < size, and where they are.
struct Grid {
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;  ///< [mm]
};

/// Fills out with the nodal values at lower <= (i, j, k) < upper, i fastest; indices may lie
/// outside the grid. Must be a pure function of the index: tiles overlap.
using NodalValues = std::function<void(const std::array<int, 3>& lower,
                                       const std::array<int, 3>& upper, float* out)>;

/// The C^2 cubic B-spline approximant sum_i c_i B(u - i) of nodal values c on a grid,
/// u = world_to_index x. It takes c as coefficients, without a prefilter: values stay within
/// the range of c and support is local, at the price of a blur of variance 1/3 spacing^2 per
/// axis. (An interpolating prefilter would overshoot next to steep edges, where the edge
/// indicator must stay in [0, 1].)
///
/// Half a spacing beyond the outermost nodes, at the voxels' outer faces, its constant continuation
/// along each index axis begins. Tiles of 16^3 cells are computed on first use and kept; sampling
/// is thread-safe and its result does not depend on the order of use.
class TiledField : public Field<3> {
 public:
  TiledField(const Grid& grid, NodalValues nodal_values);
  ~TiledField() override;

  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override;

  /// Tiles computed so far, and their bytes.
  std::size_t n_tiles() const;
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
