// Rounds of L-BFGS by Ceres over the normal displacements from the current shape.
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/detail/stepper.h"

namespace surf::flow {
namespace {

constexpr int kMostIterations = 100;   // of a round
constexpr int kMemory = 20;            // pairs; more or fewer change little
constexpr double kShareOfChart = 0.5;  // that the first step may take
constexpr double kHardlyMoved = 0.1;   // likewise
constexpr int kMostTrials = 12;        // of taking less of a round, should its end be held back

/// y with V = P^T L^-T D^(-1/2) y for the H1 product B = P^T L D L^T P: b(V, V) = |y|^2, so that
/// the first direction is that of the H1 flow on every mesh.
class Coordinates {
 public:
  explicit Coordinates(const SparseMatrix& product)
      : factor_(Eigen::SparseMatrix<double>(product)),
        root_(factor_.vectorD().cwiseMax(1e-300).cwiseSqrt()) {
    if (factor_.info() != Eigen::Success || !(factor_.vectorD().minCoeff() > 0))
      log(LogLevel::kWarning, "L-BFGS: the matrix of the H1 product is not positive definite");
  }

  Eigen::VectorXd velocity(const Eigen::VectorXd& y) const {
    Eigen::VectorXd permuted = y.cwiseQuotient(root_);
    factor_.matrixU().solveInPlace(permuted);
    Eigen::VectorXd out(y.size());
    for (Eigen::Index i = 0; i < y.size(); ++i) out[i] = permuted[place(i)];
    return out;
  }
  /// The gradient by y from that by V.
  Eigen::VectorXd gradient(const Eigen::VectorXd& by_velocity) const {
    Eigen::VectorXd permuted(by_velocity.size());
    for (Eigen::Index i = 0; i < permuted.size(); ++i) permuted[place(i)] = by_velocity[i];
    factor_.matrixL().solveInPlace(permuted);
    return permuted.cwiseQuotient(root_);
  }

 private:
  Eigen::Index place(Eigen::Index i) const { return factor_.permutationP().indices()[i]; }

  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::VectorXd root_;
};

/// J / unit as a function of y / sqrt(unit), X = X_0 + V n; the unit makes the largest component of
/// the first gradient 1, and so the first step that of the H1 flow. The shape may go as far from
/// X_0 as a step may.
template <int Dim>
class Chart : public ceres::FirstOrderFunction {
 public:
  Chart(const fem::Geometry<Dim>& shape, energy::ShapeEnergy<Dim>& energy, double max_displacement,
        const FlowOptions& options)
      : shape_(shape),
        energy_(energy),
        max_displacement_(max_displacement),
        options_(options.step) {
    const SparseMatrix A = stiffness(shape);
    const energy::ShapeTerms<Dim> terms = terms_at(shape, A);
    coordinates_.emplace(h1_product<Dim>(shape, terms, A, options.velocity.beta_floor));
    first_gradient_ = coordinates_->gradient(normal_part(terms));
    first_step_ =
        std::min(1.0, kShareOfChart * largest_step<Dim>(shape, displacement(-first_gradient_),
                                                        max_displacement_, options_));
    const double largest = first_gradient_.cwiseAbs().maxCoeff();
    if (largest > 0 && first_step_ > 0) unit_ = std::pow(largest * first_step_, 2);
  }

  int NumParameters() const override { return int(shape_.n_vertices()); }
  bool has_met_bound() const { return has_met_bound_; }
  int n_evaluations() const { return n_evaluations_; }
  /// dJ along the first direction.
  double first_derivative() const { return -first_gradient_.squaredNorm(); }

  /// The largest component of the first gradient.
  double gradient_size() const { return 1 / first_step_; }
  /// Along the first direction.
  Points<Dim> first_step() const {
    return displacement(-first_step_ / std::sqrt(unit_) * first_gradient_);
  }

  Points<Dim> displacement(const Eigen::VectorXd& y) const {
    return coordinates_->velocity(std::sqrt(unit_) * y).asDiagonal() * shape_.directions();
  }

  bool Evaluate(const double* parameters, double* value, double* gradient_out) const override {
    const Eigen::Map<const Eigen::VectorXd> y(parameters, NumParameters());
    const Points<Dim> moved = displacement(y);
    ++n_evaluations_;
    if (y.squaredNorm() > 0 &&
        !(largest_step<Dim>(shape_, moved, max_displacement_, options_) >= 1)) {
      has_met_bound_ = true;
      return false;
    }
    try {
      const fem::Geometry<Dim> at = shape_.moved_to(shape_.points() + moved);
      *value = energy_.try_move(at) / unit_;
      if (!gradient_out) return std::isfinite(*value);
      energy_.accept();
      Eigen::Map<Eigen::VectorXd>(gradient_out, NumParameters()) =
          coordinates_->gradient(normal_part(terms_at(at, stiffness(at)))) / std::sqrt(unit_);
    } catch (const InvalidMesh&) {
      has_met_bound_ = true;
      return false;
    }
    return std::isfinite(*value);
  }

 private:
  static SparseMatrix stiffness(const fem::Geometry<Dim>& at) { return fem::stiffness<Dim>(at); }
  /// At the energy's current shape.
  energy::ShapeTerms<Dim> terms_at(const fem::Geometry<Dim>& at, const SparseMatrix& A) const {
    energy::ShapeTerms<Dim> terms(at);
    energy_.differentiate(fem::curvature<Dim>(at, A), 1, terms);
    return terms;
  }
  /// dJ by V.
  Eigen::VectorXd normal_part(const energy::ShapeTerms<Dim>& terms) const {
    return terms.derivative.cwiseProduct(shape_.directions()).rowwise().sum();
  }

  const fem::Geometry<Dim>& shape_;
  energy::ShapeEnergy<Dim>& energy_;
  double max_displacement_;
  StepOptions options_;
  std::optional<Coordinates> coordinates_;
  Eigen::VectorXd first_gradient_;
  double unit_ = 1, first_step_ = 1;
  mutable bool has_met_bound_ = false;
  mutable int n_evaluations_ = 0;
};

/// Ends a round at the bound of its chart.
template <int Dim>
class EndAtBound : public ceres::IterationCallback {
 public:
  explicit EndAtBound(const Chart<Dim>& chart) : chart_(chart) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return chart_.has_met_bound() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const Chart<Dim>& chart_;
};

template <int Dim>
class LbfgsStepper : public Stepper<Dim> {
 public:
  using Stepper<Dim>::Stepper;

  bool advance(const fem::Geometry<Dim>& shape, StepRecord& record) override {
    auto* const chart =
        new Chart<Dim>(shape, this->energy_, this->moving_.max_displacement(), this->options_);
    const double J = this->energy_.value();  // differentiating may have meshed the domain anew
    ceres::GradientProblem problem(chart);   // owns it
    record.shape_derivative = chart->first_derivative();
    if (!(record.shape_derivative < 0)) return false;
    steepest_ = std::max(steepest_, -record.shape_derivative);
    Points<Dim> displacement = chart->displacement(minimise(problem, *chart, record));
    // A line search that ran into the bound and found nothing, or next to nothing, before it.
    const double room = largest_step<Dim>(shape, displacement, this->moving_.max_displacement(),
                                          this->options_.step);
    if (chart->has_met_bound() && !(room > 0 && room < 1 / kHardlyMoved))
      displacement = chart->first_step();
    for (int k = 0; k < kMostTrials; ++k) {
      record.tau = std::pow(0.5, k);
      record.n_trials = chart->n_evaluations() + k + 1;
      if (this->try_displacement(shape, record.tau * displacement, {}, record) < J) {
        this->accept(shape, record);
        return true;
      }
    }
    return false;
  }

 private:
  Eigen::VectorXd minimise(const ceres::GradientProblem& problem, const Chart<Dim>& chart,
                           const StepRecord& record) const {
    EndAtBound<Dim> end_at_bound(chart);
    ceres::GradientProblemSolver::Options options;
    options.line_search_direction_type = ceres::LBFGS;
    options.max_lbfgs_rank = kMemory;
    options.max_num_iterations = kMostIterations;
    options.function_tolerance = 1e-12;
    options.gradient_tolerance =
        0.1 * chart.gradient_size() *
        std::sqrt(this->options_.rel_tol * steepest_ / -record.shape_derivative);
    options.parameter_tolerance = 1e-10;
    options.logging_type = ceres::SILENT;
    options.callbacks.push_back(&end_at_bound);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(chart.NumParameters());
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(options, problem, y.data(), &summary);
    // A round that ends at kMostIterations, NO_CONVERGENCE, goes on from there in the next; whether
    // the flow has converged is asked of dJ.
    if (summary.termination_type == ceres::FAILURE && !chart.has_met_bound())
      log(LogLevel::kWarning, fmt::format("L-BFGS: {}", summary.message));
    return y;
  }

  double steepest_ = 0;  // |dJ| along the first direction of a round, the largest so far
};

}  // namespace

constexpr StepperMaker kLbfgsSteppers = stepper_maker<LbfgsStepper>();

}  // namespace surf::flow
