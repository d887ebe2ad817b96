// Densities that depend on the place and on the mean curvature.
#pragma once

#include <memory>

#include "libsurf/base/field.h"

namespace surf::energy {

/// Values H(x, z), and as many derivatives as were asked for, at n pairs of points and curvatures.
template <int Dim>
struct CurvatureSamples {
  Eigen::VectorXd value, dz, dzz;  ///< (n); derivatives empty unless asked for
  Points<Dim> dx, dxz;             ///< (n, Dim)
  Eigen::Matrix<double, Eigen::Dynamic, Dim * Dim, Eigen::RowMajor> dxx;  ///< (n, Dim*Dim)

  /// Everything that was asked for is set to zero.
  void resize(Eigen::Index n, Derivatives order);
};

/// H(x, z) of (1.8) with the mean curvature z, the sum of the principal ones. Thread-safe.
template <int Dim>
class CurvatureDensity {
 public:
  virtual ~CurvatureDensity() = default;
  /// @param x  points [mm], (n, Dim);  @param z  mean curvatures [1/mm], (n); out is resized
  virtual void sample(const Points<Dim>& x, const Eigen::VectorXd& z, Derivatives order,
                      CurvatureSamples<Dim>& out) const = 0;
};

/// H(x, z) = f(x) (z - z_0)^2 / 2. With f = 1 the Willmore energy with the spontaneous curvature
/// z_0; with f an edge indicator a curvature that is prescribed where no edge says otherwise.
/// @param z_0  [1/mm]
template <int Dim>
std::shared_ptr<const CurvatureDensity<Dim>> squared_curvature(std::shared_ptr<const Field<Dim>> f,
                                                               double z_0);

}  // namespace surf::energy
