// Newton's method within a trust region.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

namespace surf::flow {

using LinearMap = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// m(V) = g^T V + V^T H V / 2 in the norm |V|^2 = V^T P V.
struct QuadraticModel {
  Eigen::VectorXd gradient;                        ///< g
  LinearMap hessian;                               ///< H, symmetric
  LinearMap preconditioner;                        ///< P^-1, symmetric positive definite
  std::optional<Eigen::VectorXd> constraint = {};  ///< q: only V with q^T V = 0

  double operator()(const Eigen::VectorXd& V) const;
};

struct TrustRegionOptions {
  /// Conjugate gradients stop when the residual, in the norm of P^-1, falls to this share.
  double tolerance = 1e-3;
  /// Or after so many. That is no failure: every iterate lowers m, and what the step gains is held
  /// against what m says of it, however near to m's minimum it is.
  int max_iterations = 200;
};

struct TrustRegionStep {
  Eigen::VectorXd V;
  double norm = 0;  ///< |V|
  bool is_at_boundary = false;
  bool has_negative_curvature = false;  ///< H is not positive definite
  int n_iterations = 0;
};

/// Minimises m over |V| <= radius by preconditioned conjugate gradients (Steihaug 1983): Newton's
/// step where H is positive definite and the step is short enough; else up to the boundary, along
/// the first direction of negative curvature. m(V) <= m of the steepest descent in the norm of P.
TrustRegionStep minimise_in_trust_region(const QuadraticModel& model, double radius,
                                         const TrustRegionOptions& options = {});

}  // namespace surf::flow
