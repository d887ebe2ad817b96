// Densities that depend on the place and on the direction of the normal.
#pragma once

#include <memory>

#include "libsurf/base/field.h"
#include "libsurf/energy/fields.h"

namespace surf::energy {

/// Values H(x, y), and as many derivatives as were asked for, at n pairs of points and normals.
template <int Dim>
struct DensitySamples {
  using Hessians = Eigen::Matrix<double, Eigen::Dynamic, Dim * Dim, Eigen::RowMajor>;

  Eigen::VectorXd value;   ///< (n)
  Points<Dim> dx, dy;      ///< H_x [1/mm] and H_y, (n, Dim); empty unless asked for
  Hessians dxx, dxy, dyy;  ///< (n, Dim*Dim); row a, column b of dxy: d^2 H / (dx_a dy_b)

  /// Everything that was asked for is set to zero.
  void resize(Eigen::Index n, Derivatives order);
  /// Adds factor * other, which has the same size.
  void add(double factor, const DensitySamples& other);
};

/// H(x, y) of (1.7), used at unit normals y. It may be continued to other y in any smooth way: the
/// derivatives of the energy do not depend on it. Thread-safe.
template <int Dim>
class AnisotropicDensity {
 public:
  virtual ~AnisotropicDensity() = default;
  /// @param x, y  points [mm] and unit normals, (n, Dim); out is resized
  virtual void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
                      DensitySamples<Dim>& out) const = 0;
};

template <int Dim>
using DensityPointer = std::shared_ptr<const AnisotropicDensity<Dim>>;

/// H(x), the same for every normal.
template <int Dim>
DensityPointer<Dim> isotropic_density(std::shared_ptr<const Field<Dim>> H);

/// factor * H.
template <int Dim>
DensityPointer<Dim> scaled_density(DensityPointer<Dim> H, double factor);

/// H(x) sqrt(y . M y): the length or area in the metric M, weighted by H.
/// @param M  symmetric positive definite
template <int Dim>
DensityPointer<Dim> norm_density(std::shared_ptr<const Field<Dim>> H,
                                 const Eigen::Matrix<double, Dim, Dim>& M);

/// phi(<grad I, y>): the edge alignment of Kimmel and Bruckstein.
/// @param phi      with its first and second derivative, see signed_alignment, absolute_alignment
/// @param step_mm  d^2 H / dx^2 needs third derivatives of I: differences of D2I along y over
///                 +-step. A hundredth of a cell for the piecewise cubic fields of images.
template <int Dim>
DensityPointer<Dim> alignment_density(std::shared_ptr<const Field<Dim>> I, Profile phi,
                                      double step_mm);

/// phi(s) = sign * s / scale: smallest, with sign = 1, where I falls most steeply along the outward
/// normal, at the rim of a bright object; -1 for dark ones.
Profile signed_alignment(double sign, double scale);

/// phi(s) = -sqrt((s / scale)^2 + smoothing^2): smallest at steep edges of either sign.
Profile absolute_alignment(double scale, double smoothing);

}  // namespace surf::energy
