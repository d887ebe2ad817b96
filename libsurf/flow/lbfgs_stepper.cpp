// Rounds of L-BFGS by Ceres over the normal displacements from the current shape.
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/stepper.h"

namespace surf::flow {
namespace {

constexpr int kMostIterations = 100;  // of a round
constexpr int kMemory = 20;           // pairs; more or fewer change little
constexpr int kMostTrials = 12;       // of taking less of a round, should its end be held back

/// J as a function of y, X = X_0 + s_i y_i n_i with s_i ~ 1 / sqrt(m_i): the scalar product of the
/// y is that of L2, and 1 is about an edge. The shape may go as far from X_0 as a step may.
template <int Dim>
class Chart : public ceres::FirstOrderFunction {
 public:
  Chart(const fem::Geometry<Dim>& shape, energy::ShapeEnergy<Dim>& energy, double max_displacement,
        const StepOptions& options)
      : shape_(shape), energy_(energy), max_displacement_(max_displacement), options_(options) {
    const double mean_mass = shape.lumped_mass().mean();
    const double edge = std::pow(mean_mass, 1.0 / (Dim - 1));
    scale_ = edge * (mean_mass / shape.lumped_mass().array()).sqrt();
  }

  int NumParameters() const override { return int(shape_.n_vertices()); }
  bool has_met_bound() const { return has_met_bound_; }
  int n_evaluations() const { return n_evaluations_; }

  Points<Dim> displacement(const Eigen::VectorXd& y) const {
    return scale_.cwiseProduct(y).asDiagonal() * shape_.nodal_normals();
  }
  /// dJ by y at the energy's current shape.
  Eigen::VectorXd gradient(const fem::Geometry<Dim>& at) const {
    const SparseMatrix A = fem::stiffness<Dim>(at, Eigen::VectorXd::Ones(at.n_elements()));
    energy::ShapeTerms<Dim> terms(at);
    energy_.differentiate(fem::curvature<Dim>(at, A), 1, terms);
    return terms.derivative.cwiseProduct(shape_.nodal_normals())
        .rowwise()
        .sum()
        .cwiseProduct(scale_);
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
      *value = energy_.try_move(at);
      if (!gradient_out) return std::isfinite(*value);
      energy_.accept();
      Eigen::Map<Eigen::VectorXd>(gradient_out, NumParameters()) = gradient(at);
    } catch (const InvalidMesh&) {
      has_met_bound_ = true;
      return false;
    }
    return std::isfinite(*value);
  }

 private:
  const fem::Geometry<Dim>& shape_;
  energy::ShapeEnergy<Dim>& energy_;
  double max_displacement_;
  StepOptions options_;
  Eigen::VectorXd scale_;
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
    const double J = this->energy_.value();
    auto* const chart =
        new Chart<Dim>(shape, this->energy_, this->moving_.max_displacement(), this->options_.step);
    ceres::GradientProblem problem(chart);  // owns it
    const Eigen::VectorXd gradient = chart->gradient(shape);
    record.shape_derivative = -gradient.squaredNorm();
    const Points<Dim> displacement = chart->displacement(minimise(problem, *chart, gradient));
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
                           const Eigen::VectorXd& gradient) const {
    EndAtBound<Dim> end_at_bound(chart);
    ceres::GradientProblemSolver::Options options;
    options.line_search_direction_type = ceres::LBFGS;
    options.max_lbfgs_rank = kMemory;
    options.max_num_iterations = kMostIterations;
    options.function_tolerance = 1e-12;
    options.gradient_tolerance =
        std::sqrt(this->options_.rel_tol) * gradient.cwiseAbs().maxCoeff() / 10;
    options.parameter_tolerance = 1e-10;
    options.logging_type = ceres::SILENT;
    options.callbacks.push_back(&end_at_bound);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(chart.NumParameters());
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(options, problem, y.data(), &summary);
    return y;
  }
};

}  // namespace

template <int Dim>
std::unique_ptr<Stepper<Dim>> make_lbfgs_stepper(const StepSetting<Dim>& setting) {
  return std::make_unique<LbfgsStepper<Dim>>(setting);
}

template std::unique_ptr<Stepper<2>> make_lbfgs_stepper<2>(const StepSetting<2>&);
template std::unique_ptr<Stepper<3>> make_lbfgs_stepper<3>(const StepSetting<3>&);

}  // namespace surf::flow
