// The integral of a spline field of a volume's grid along its first index axis.
#pragma once

#include <memory>

#include "libsurf/volume/tiled_field.h"

namespace surf::volume {

/// P with dP/du_1 = I for the field I that a TiledField of the same nodal values c is, u the index:
/// the integral of a cubic B-spline is a quartic one whose coefficients are the sums of c,
///   P = sum_n C_n B4(u_1 - n - 1/2), C_n = sum_(i <= n) c_i,
/// up to what does not depend on u_1. Values alone are computed.
///
/// Whole rows of tiles are computed on first use and kept, in floats: about 6 bytes a node.
/// Sampling is thread-safe and its result does not depend on the order of use.
class SplineIntegral : public Field<3> {
 public:
  SplineIntegral(const Grid& grid, NodalValues nodal_values);
  ~SplineIntegral() override;

  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override;
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
