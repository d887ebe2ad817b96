// The Mumford-Shah model on volumes (thesis 2.2.3 and 5.2, there in the plane).
#pragma once

#include <memory>
#include <string>

#include "libsurf/base/field.h"
#include "libsurf/energy/mumford_shah_weights.h"
#include "libsurf/energy/shape_energy.h"
#include "libsurf/volume/screened_poisson.h"

namespace surf::energy {

struct MumfordShahOptions : MumfordShahWeights {
  /// The two problems are solved in a box round the surface, which keeps at least half this many
  /// times sqrt(mu) from it, unless the image ends: what lies d away counts by
  /// exp(-d / sqrt(mu)) in u and by its square in the derivative.
  double margin = 6;
  /// J's relative error is about 1e-6 with this tolerance, dJ's 1e-4.
  volume::ScreenedPoissonOptions solver{.tolerance = 1e-4};

  std::string error() const;  ///< empty if valid
};

/// J(Gamma) = sum_i 1/2 int_{Omega_i} ((u_i - I)^2 + mu |grad u_i|^2) + gamma |Gamma| (5.4) in
/// mm^3, with -mu Lap u_i + u_i = I in Omega_i, d_nu u_i = 0, I the intensity by the contrast.
///
/// u and I are trilinear on the image's grid, the surface cuts its cells (ScreenedPoisson). The
/// derivative, 1/2 int [(u - I)^2 + mu |grad u|^2] W . nu dS + gamma d|Gamma| of Theorem 2.2.10, is
/// the exact one of this J, up to the solver's tolerance; so it has the whole gradient, whose
/// normal part vanishes with the grid's spacing. Where trial surfaces intersect themselves, J is
/// that of the domain where they wind at least once.
///
/// Every value costs the solution of both problems, started from the last one. J counts what lies
/// in the box; where the box has to grow J is continued without a jump, until the next reset.
///
/// Scalar product of 5.2: alpha = gamma,
/// beta = 1/2 (kappa ([(u - I)^2] + mu [|grad u|^2]) + d_nu [(u - I)^2]).
class MumfordShah : public ShapeEnergy<3> {
 public:
  /// @param I     the intensity
  /// @param grid  where it is sampled, the image's domain
  /// @throws UsageError  options.error() is not empty
  MumfordShah(std::shared_ptr<const Field<3>> I, const volume::Grid& grid,
              const MumfordShahOptions& options);
  ~MumfordShah() override;

  std::string name() const override { return "mumford-shah"; }
  void reset(const fem::Geometry<3>& shape) override;
  double value() const override;
  double try_move(const fem::Geometry<3>& moved) override;
  void accept() override;
  void remesh(const fem::Geometry<3>& shape) override;
  /// J jumps where surgery joins what a thin sheet has parted: steps that gain are not taken for
  /// ones that lose.
  void rebuild(const fem::Geometry<3>& shape) override;
  double drift() const override { return drift_; }
  void differentiate(const fem::Curvature&, double, ShapeTerms<3>&) const override;
  /// Theorem 2.2.11, in space: as d_nu u_i = 0 all along the surface, d_nu |grad u_i|^2 is
  /// -2 S(grad_Gamma u_i, grad_Gamma u_i), S the shape operator, and gamma |Gamma| has its term of
  /// Gauss' curvature. The last line, with u' of the velocity, is an operator: each product solves
  /// both problems once.
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           SecondDerivative<3>& second) const override;
  /// With the mean of u_2 in place of what u would be in the hole:
  /// F = 1/2 ((I - u_1)^2 - (I - mean)^2).
  void add_density(const Points<3>&, double, Eigen::VectorXd&) const override;

 private:
  struct Box;
  struct State;
  struct Loads;
  class Response;

  Box box_round(const Points<3>& points, double margin) const;
  std::shared_ptr<const std::vector<double>> intensities(const Box& box) const;
  std::unique_ptr<State> solved(const fem::Geometry<3>& shape, const Box& box,
                                const State* start) const;
  void make_room_for(const Points<3>& points);
  template <class Visit>
  void for_points(const Visit& visit) const;
  Loads loads() const;
  Eigen::VectorXd intensity_slope() const;

  std::shared_ptr<const Field<3>> I_;
  volume::Grid grid_;
  MumfordShahOptions options_;
  std::unique_ptr<State> state_, tried_;
  double offset_ = 0;  // of J, by what boxes have grown
  double drift_ = 0;
};

}  // namespace surf::energy
