// Steps of Newton's method with the whole second derivative, within a trust region.
#include <algorithm>
#include <cmath>

#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/detail/stepper.h"
#include "libsurf/flow/detail/symmetric_solver.h"
#include "libsurf/flow/detail/trust_region.h"

namespace surf::flow {
namespace {

constexpr double kFirstRadius = 10;   // of the norm of the first step of steepest descent
constexpr double kLeastRatio = 0.1;   // of actual to predicted decrease
constexpr double kPoorRatio = 0.25;   // below: the region shrinks
constexpr double kGoodRatio = 0.75;   // above: it grows
constexpr double kMuchTooLong = 0.7;  // as little of a step may be taken
constexpr double kFastestShrinking = 0.1;
constexpr int kMostShrinkings = 8;
// Conformal maps leave the Willmore energy as it is: along them the discrete one falls as meshes
// degenerate. Energies of fourth order get this times c / r^4 as a shift of the second derivative.
constexpr double kFourthOrderShift = 5;
constexpr double kCoarsestSolve = 0.1;  // tolerance far from the minimum

template <int Dim>
class NewtonStepper : public Stepper<Dim> {
 public:
  using Stepper<Dim>::Stepper;

  bool advance(const fem::Geometry<Dim>& shape, StepRecord& record) override {
    const System system(shape, this->energy_, this->options_.velocity.beta_floor,
                        this->content_.has_value());
    const double norm = std::sqrt(system.steepest_decrease);
    if (!(norm > 0) || !std::isfinite(norm)) return false;
    steepest_ = std::max(steepest_, norm);
    if (!(radius_ > 0)) radius_ = kFirstRadius * norm;
    const TrustRegionOptions solve{
        .tolerance =
            std::clamp(norm / steepest_, this->options_.velocity.solver_tolerance, kCoarsestSolve)};
    const double J = this->energy_.value();
    record.multiplier = system.multiplier;
    for (record.n_trials = 1; record.n_trials <= this->options_.step.max_trials;
         ++record.n_trials) {
      const TrustRegionStep step = bounded_step(shape, system, solve, record.tau);
      const Points<Dim> velocity = step.V.asDiagonal() * shape.directions();
      // Of a step that the region cuts short as it would be with the length of the steepest
      // descent: a small region is no minimum.
      const double share = step.is_at_boundary ? std::min(1.0, step.norm / norm) : 1;
      record.shape_derivative = system.derivative.dot(step.V) / share;
      if (!(record.tau > 0)) return false;
      const double J_new =
          this->try_displacement(shape, record.tau * velocity, system.content_direction, record);
      const double predicted = system.model(normal_part(shape, this->to_ - shape.points()));
      const double ratio = predicted < 0 ? (J_new - J) / predicted : 0;
      const double moved = record.tau * step.norm;
      if (!(J_new < J && ratio >= kLeastRatio)) {
        radius_ = kPoorRatio * moved;
        continue;
      }
      if (ratio < kPoorRatio) radius_ = moved / 2;
      if (ratio > kGoodRatio && step.is_at_boundary) radius_ = std::max(radius_, 2 * moved);
      this->accept(shape, record);
      return true;
    }
    record.n_trials = this->options_.step.max_trials;
    return false;
  }

 private:
  /// The model of J at one shape; on the shapes of one content that of J + lambda C.
  struct System {
    System(const fem::Geometry<Dim>& shape, const energy::ShapeEnergy<Dim>& energy,
           double beta_floor, bool keeps_content)
        : A(fem::stiffness<Dim>(shape)), second(shape) {
      const fem::Curvature curvature = fem::curvature<Dim>(shape, A);
      energy::ShapeTerms<Dim> terms(shape);
      energy.differentiate(curvature, 1, terms);
      energy.differentiate_twice(curvature, 1, second);
      derivative = terms.derivative.cwiseProduct(shape.directions()).rowwise().sum();
      norm = std::make_unique<SymmetricSolver>(h1_product<Dim>(shape, terms, A, beta_floor));
      diagonal = kFourthOrderShift * std::max(0.0, second.bilaplacian.maxCoeff()) /
                 std::pow(shape.radius(), 4) * shape.lumped_mass();
      model.gradient = derivative;
      model.preconditioner = [this](const Eigen::VectorXd& r) { return norm->solve(r, 0); };
      if (keeps_content) keep_content(shape, curvature);
      const Eigen::VectorXd step = norm->solve(model.gradient, 0);
      steepest_decrease = model.gradient.dot(step);
      model.hessian = [this, &shape](const Eigen::VectorXd& V) -> Eigen::VectorXd {
        Eigen::VectorXd out = second.times(shape, A, V);
        return out += diagonal.cwiseProduct(V);
      };
    }

    /// dC = int V dS, d2C = int kappa V W dS.
    void keep_content(const fem::Geometry<Dim>& shape, const fem::Curvature& curvature) {
      const Eigen::VectorXd q = shape.content_derivative();
      content_direction = q;
      if (q.isZero(0)) return;  // no vertex can move
      content_direction = norm->solve(q, 0);
      multiplier = -derivative.dot(content_direction) / q.dot(content_direction);
      diagonal += multiplier * shape.lumped_mass().cwiseProduct(curvature.mean);
      model.constraint = q;
      model.gradient += multiplier * q;
    }

    SparseMatrix A;
    energy::SecondDerivative<Dim> second;
    std::unique_ptr<SymmetricSolver> norm;
    Eigen::VectorXd derivative;  // of J along the normals
    Eigen::VectorXd content_direction;
    Eigen::VectorXd diagonal;  // what is added to the second derivative
    double multiplier = 0, steepest_decrease = 0;
    QuadraticModel model;
  };

  /// The step within the region, which shrinks until no vertex goes much further than it may: a
  /// short step in a small region beats the beginning of a long one. `tau` is what of it is left.
  TrustRegionStep bounded_step(const fem::Geometry<Dim>& shape, const System& system,
                               const TrustRegionOptions& solve, double& tau) {
    for (int k = 0;; ++k) {
      TrustRegionStep step = minimise_in_trust_region(system.model, radius_, solve);
      const double longest =
          largest_step<Dim>(shape, step.V.asDiagonal() * shape.directions(),
                            this->moving_.max_displacement(), this->options_.step);
      tau = std::min(1.0, longest);
      if (tau > kMuchTooLong || k == kMostShrinkings || !(tau > 0)) return step;
      radius_ = std::max(tau, kFastestShrinking) * step.norm;
    }
  }

  /// V with displacement = V n, as far as it is along the normals.
  static Eigen::VectorXd normal_part(const fem::Geometry<Dim>& shape,
                                     const Points<Dim>& displacement) {
    const Points<Dim>& n = shape.directions();
    return displacement.cwiseProduct(n).rowwise().sum().cwiseQuotient(
        n.rowwise().squaredNorm().cwiseMax(1e-12));
  }

  double radius_ = 0;
  double steepest_ = 0;  // norm of the steepest gradient so far
};

}  // namespace

constexpr StepperMaker kNewtonSteppers = stepper_maker<NewtonStepper>();

}  // namespace surf::flow
