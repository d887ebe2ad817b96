#include "libsurf/mesh/fit_ellipsoid.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"

namespace surf::mesh {
namespace {

constexpr double kRoundness = 0.05;  // weight of the axes' logarithms, times the size
constexpr double kCentring = 0.02;   // weight of the centre's distance from the mean
constexpr double kFlat = 1e-6;       // of the largest deviation: points on a line

/// Angles of a turn: one in the plane, an axis times an angle in space.
template <int Dim>
constexpr int kTurns = Dim == 2 ? 1 : 3;

/// R^T x.
template <class T>
void turn_back(const T* turn, const std::array<T, 2>& x, std::array<T, 2>& out) {
  using std::cos, std::sin;
  const T c = cos(turn[0]), s = sin(turn[0]);
  out = {c * x[0] + s * x[1], -s * x[0] + c * x[1]};
}
template <class T>
void turn_back(const T* turn, const std::array<T, 3>& x, std::array<T, 3>& out) {
  const std::array<T, 3> back = {-turn[0], -turn[1], -turn[2]};
  ceres::AngleAxisRotatePoint(back.data(), x.data(), out.data());
}

/// Distance of a point from the ellipsoid to first order, after an initial turn to the principal
/// axes of all points.
template <int Dim>
struct DistanceTerm {
  Vector<Dim> point;

  template <class T>
  bool operator()(const T* center, const T* log_axes, const T* turn, T* residual) const {
    using std::exp, std::sqrt;
    std::array<T, Dim> x, y;
    for (int i = 0; i < Dim; ++i) x[i] = T(point[i]) - center[i];
    turn_back(turn, x, y);
    T square(0), gradient(0);
    for (int i = 0; i < Dim; ++i) {
      const T q = y[i] * exp(-log_axes[i]);
      square += q * q;
      gradient += q * q * exp(-2.0 * log_axes[i]);
    }
    const T length = sqrt(square + 1e-30);
    residual[0] = (length - 1.0) * length / sqrt(gradient + 1e-30);
    return true;
  }
};

/// Log axes less their mean.
template <int Dim>
struct RoundnessTerm {
  double weight;
  template <class T>
  bool operator()(const T* log_axes, T* residuals) const {
    T mean(0);
    for (int i = 0; i < Dim; ++i) mean += log_axes[i] / double(Dim);
    for (int i = 0; i < Dim; ++i) residuals[i] = weight * (log_axes[i] - mean);
    return true;
  }
};

template <int Dim>
struct CentringTerm {
  template <class T>
  bool operator()(const T* center, T* residuals) const {
    for (int i = 0; i < Dim; ++i) residuals[i] = kCentring * center[i];
    return true;
  }
};

/// Coordinates about the mean along the principal axes.
template <int Dim>
struct Frame {
  Vector<Dim> mean, deviations;          // deviations: largest first
  Eigen::Matrix<double, Dim, Dim> axes;  // columns
  explicit Frame(const Points<Dim>& points) : mean(points.colwise().mean()) {
    const Points<Dim> centred = points.rowwise() - mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Dim, Dim>> solver(
        centred.transpose() * centred / double(points.rows()));
    axes = solver.eigenvectors().rowwise().reverse();
    deviations = solver.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
    if (axes.determinant() < 0) axes.col(Dim - 1) *= -1;
  }
};

/// What is varied, in the frame's coordinates.
template <int Dim>
struct Parameters {
  std::array<double, Dim> center{}, log_axes{};
  std::array<double, kTurns<Dim>> turn{};

  Eigen::Matrix<double, Dim, Dim> rotation() const {
    Eigen::Matrix<double, Dim, Dim> R;
    for (int k = 0; k < Dim; ++k) {
      std::array<double, Dim> e{}, out{};
      e[k] = 1;
      turn_back(turn.data(), e, out);
      for (int i = 0; i < Dim; ++i) R(k, i) = out[i];  // R^T e_k is the k-th row of R
    }
    return R;
  }
};

template <int Dim>
void check(const Points<Dim>& points, const Frame<Dim>& frame) {
  if (points.rows() <= Dim)
    throw UsageError(fmt::format("landmarks: {} points; at least {} are needed for an {}",
                                 points.rows(), Dim + 1, Dim == 2 ? "ellipse" : "ellipsoid"));
  if (!(frame.deviations[1] > kFlat * frame.deviations[0]))
    throw UsageError(
        "landmarks: all points lie on a line; click some on other sides of the object");
}

template <int Dim>
Parameters<Dim> minimise(const Points<Dim>& local, const Vector<Dim>& deviations) {
  Parameters<Dim> p;
  // Of points spread over a sphere the square of each coordinate has the mean r^2 / Dim.
  const double size = std::sqrt(deviations.squaredNorm());
  for (int i = 0; i < Dim; ++i)
    p.log_axes[i] = std::log(std::max(std::sqrt(double(Dim)) * deviations[i], size / 2));
  ceres::Problem problem;
  for (Eigen::Index i = 0; i < local.rows(); ++i)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DistanceTerm<Dim>, 1, Dim, Dim, kTurns<Dim>>(
            new DistanceTerm<Dim>{local.row(i)}),
        nullptr, p.center.data(), p.log_axes.data(), p.turn.data());
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RoundnessTerm<Dim>, Dim, Dim>(
                               new RoundnessTerm<Dim>{kRoundness * size}),
                           nullptr, p.log_axes.data());
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<CentringTerm<Dim>, Dim, Dim>(new CentringTerm<Dim>), nullptr,
      p.center.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (summary.termination_type != ceres::CONVERGENCE)
    log(LogLevel::kWarning,
        fmt::format("landmarks: the {} is not sure, the points hardly determine it; click some on "
                    "other sides of the object ({})",
                    Dim == 2 ? "ellipse" : "ellipsoid", summary.message));
  return p;
}

}  // namespace

template <int Dim>
Ellipsoid<Dim> fit_ellipsoid(const Points<Dim>& points) {
  const Frame<Dim> frame(points);
  check<Dim>(points, frame);
  const Points<Dim> local = (points.rowwise() - frame.mean.transpose()) * frame.axes;
  const Parameters<Dim> p = minimise<Dim>(local, frame.deviations);
  Ellipsoid<Dim> out;
  out.center = frame.mean + frame.axes * Eigen::Map<const Vector<Dim>>(p.center.data());
  std::array<int, Dim> order;
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return p.log_axes[a] > p.log_axes[b]; });
  const Eigen::Matrix<double, Dim, Dim> directions = frame.axes * p.rotation();
  for (int i = 0; i < Dim; ++i)
    out.axes.col(i) = std::exp(p.log_axes[order[i]]) * directions.col(order[i]);
  for (Eigen::Index i = 0; i < local.rows(); ++i) {
    double distance = 0;
    DistanceTerm<Dim>{local.row(i)}(p.center.data(), p.log_axes.data(), p.turn.data(), &distance);
    out.rms += distance * distance / double(local.rows());
  }
  out.rms = std::sqrt(out.rms);
  return out;
}

template struct Ellipsoid<2>;
template struct Ellipsoid<3>;
template Ellipsoid<2> fit_ellipsoid<2>(const Points<2>&);
template Ellipsoid<3> fit_ellipsoid<3>(const Points<3>&);

}  // namespace surf::mesh
