// The two-region statistics model of Chan and Vese.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "libsurf/base/field.h"
#include "libsurf/energy/region_energy.h"

namespace surf::energy {

/// Integrals over the whole image domain D that holds the shape.
struct ImageTotals {
  double content = 0;            ///< |D| [mm^Dim]
  double intensity = 0;          ///< int_D I
  double intensity_squared = 0;  ///< int_D I^2
};

/// A way to int_Omega I from the boundary alone: P with direction . grad P = I, so that the
/// divergence theorem gives int_Gamma P direction . nu dS.
template <int Dim>
struct Antiderivative {
  Vector<Dim> direction;
  std::shared_ptr<const Field<Dim>> P;  ///< its value
  double spacing_mm;                    ///< of the lines along which it is summed
};

struct ChanVeseOptions {
  int quadrature_order = 2;
  double ray_spacing_mm = 1;  ///< see DomainIntegralOptions
  /// Intensities are divided by this, so that J does not depend on their unit.
  double intensity_scale = 1;
};

/// J(Omega) = sum_i int_{Omega_i} (I - mu_i)^2 dx with Omega_1 inside, Omega_2 = D - Omega_1
/// and mu_i the mean over Omega_i (1.1.2; the printed mu_i lacks the 1/|Omega_i|). The length
/// term of 1.1.2 is a BoundaryIntegral beside it.
///
/// J = Q - S_1^2/V_1 - S_2^2/V_2 with the integrals S of I and V of 1, so only S_1 and V_1
/// follow the surface. Since mu_i is optimal, G = (I - mu_1)^2 - (I - mu_2)^2, g = 0;
/// beta = d_nu G + kappa G at fixed means; the second derivative of J as a function of V_1 and S_1
/// is the rank-two part of d2J (Theorem 2.2.7 for two integrals).
template <int Dim>
class ChanVese : public RegionEnergy<Dim> {
 public:
  /// @param antiderivative  of I; if there is one, the integrals over Omega, which every change of
  ///                        topology asks for anew, cost the boundary in place of the domain
  ChanVese(std::shared_ptr<const Field<Dim>> I, const ImageTotals& totals,
           const ChanVeseOptions& options,
           const std::optional<Antiderivative<Dim>>& antiderivative = {});

  std::string name() const override { return "chan-vese"; }

  /// Means inside and outside the current shape, in the image's unit.
  std::array<double, 2> means() const;

 private:
  bool is_cheap_from_scratch() const override { return bool(antiderivative_); }
  Eigen::VectorXd integrals_over(const fem::Geometry<Dim>& shape) const override;
  Eigen::VectorXd change_between(const fem::Geometry<Dim>& from,
                                 const fem::Geometry<Dim>& to) const override;
  double value_of(const Eigen::VectorXd& inside) const override;
  std::function<std::array<double, 2>(double)> density() const override;
  Eigen::MatrixXd second_of_integrals() const override;

  std::optional<Antiderivative<Dim>> antiderivative_;
  ImageTotals totals_;
  double squared_scale_;  // of the intensities
};

}  // namespace surf::energy
