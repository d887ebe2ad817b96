#include "libsurf/segment/detail/edge_profiles.h"

#include <ceres/tiny_solver.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {
namespace {

// Of a vertex' own step.
constexpr double kOwnShare = 0.4;   // of the step
constexpr double kOwnAround = 0.6;  // of the vertices about it, itself a third of them
constexpr double kFewCells = 6;     // on either side

using Sparse = Eigen::SparseMatrix<double>;

constexpr int kBins = 21;
constexpr double kLeastMass = 1e-3;  // of the mean mass of vertices
constexpr double kHuber = 2;         // deviations of a bin's mean
constexpr double kLeastCells = 0.5;  // of a bin that counts
constexpr double kBinShare = 1e-3;   // of the deviation of a bin: levels and erf are models
// By which a step lowers the sum of squared residuals, nothing beside 1: TinySolver takes its
// function_tolerance as it is, not relative to the sum.
constexpr double kTolerance = 1e-4;
constexpr double kPlaceRange = 0.35;  // of the reach: deviation of where the step is expected
constexpr std::size_t kMostOfMedian = 100000;  // amounts, of millions
constexpr double kFarOff = 4;                  // deviations: cells beyond are not noise

double erf_step(double z) { return std::erf(z / std::numbers::sqrt2); }
double normal_density(double z) { return std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi); }

// Of a profile. Rows beyond the bins, and bins that few cells lie in, have no weight.
constexpr int kRows = 24;  // a multiple of what Eigen computes at once
static_assert(kRows >= kBins);
using Rows = Eigen::Array<double, kRows, 1>;
struct Bins {
  Rows distance = Rows::Zero(), mean = Rows::Zero(), weight = Rows::Zero();
};

/// Both, from one exponential: Abramowitz and Stegun 7.1.26, erf to 1.5e-7. Of a bin, whose mean is
/// known no better than to a thousandth.
struct StepsAndDensities {
  Rows step, density;

  StepsAndDensities() = default;
  explicit StepsAndDensities(const Rows& z) {
    const Rows x = z.abs() / std::numbers::sqrt2, bell = (-x * x).exp();
    const Rows t = 1 / (1 + 0.3275911 * x);
    const Rows tail =
        t *
        (0.254829592 +
         t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) *
        bell;
    step = z.sign() * (1 - tail);
    density = bell * (std::numbers::inv_sqrtpi / std::numbers::sqrt2);
  }
};

/// Residuals of one profile in (mid level, half height, place, log width), for ceres::TinySolver.
class ProfileCost {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = kRows + 2, NUM_PARAMETERS = 4 };

  ProfileCost(const Bins& bins, const ProfileOptions& options)
      : bins_(bins),
        place_mm_(kPlaceRange * options.reach_mm),
        log_width_(std::log(options.width_mm)),
        log_range_(std::log(options.width_range)) {}

  /// Column-major J, (residuals, 4).
  bool operator()(const double* x, double* residuals, double* J) const {
    const double level = x[0], height = x[1], place = x[2], per_width = std::exp(-x[3]);
    const Rows z = (bins_.distance - place) * per_width;
    if (at_ != std::array{place, x[3]}) {  // derivatives are asked for where values have just been
      at_ = {place, x[3]};
      steps_ = StepsAndDensities(z);
    }
    const Rows raw = bins_.weight * (level + height * steps_.step - bins_.mean);
    // Pseudo-Huber: r' = sign(r) sqrt(2 c^2 (sqrt(1 + r^2 / c^2) - 1)).
    const Rows root = (1 + raw * raw / (kHuber * kHuber)).sqrt();
    const Rows scale = (2 / (root + 1)).sqrt();  // r' / r
    using Column = Eigen::Matrix<double, NUM_RESIDUALS, 1>;
    Eigen::Map<Column>(residuals, NUM_RESIDUALS) << (raw * scale).matrix(), place / place_mm_,
        (x[3] - log_width_) / log_range_;
    if (!J) return true;
    const Rows by_value = bins_.weight / (scale * root);  // dr' / dr * weight
    const Rows slope = 2 * height * steps_.density * by_value;
    Eigen::Map<Eigen::Matrix<double, NUM_RESIDUALS, 4>> by(J);
    by.template topRows<kRows>() << by_value, by_value * steps_.step, -slope * per_width,
        -slope * z;
    by.template bottomRows<2>() << 0, 0, 1 / place_mm_, 0, 0, 0, 0, 1 / log_range_;
    return true;
  }

 private:
  const Bins& bins_;
  double place_mm_, log_width_, log_range_;  // priors
  mutable std::array<double, 2> at_ = {std::numeric_limits<double>::quiet_NaN(), 0};
  mutable StepsAndDensities steps_;
};

// Vertices whose elements all lie on the image's border have no mass of their own.
template <int Dim>
Sparse pool_matrix(const fem::Geometry<Dim>& geometry, double pool_mm) {
  Sparse out = pool_mm * pool_mm *
               Sparse(fem::stiffness<Dim>(geometry, Eigen::VectorXd::Ones(geometry.n_elements())));
  const Eigen::VectorXd& mass = geometry.lumped_mass();
  out += Sparse(mass.cwiseMax(kLeastMass * mass.mean()).asDiagonal());
  return out;
}

/// A robust deviation: of the lower half of the amounts.
double robust_deviation(std::vector<double> amounts) {
  if (amounts.empty()) return 0;
  const auto middle = amounts.begin() + std::ptrdiff_t(amounts.size() / 2);
  std::nth_element(amounts.begin(), middle, amounts.end());
  return *middle / 0.6745;
}

/// A power of two, by which dividing rounds nothing, not above the height of a step; 1 for none.
double unit_of(double height) {
  return height > 0 && std::isfinite(height) ? std::exp2(std::ilogb(height)) : 1;
}

/// So many of them, evenly spread, that their median is known to half a percent.
std::vector<double> some_of(const std::vector<double>& amounts) {
  const std::size_t stride = 1 + amounts.size() / kMostOfMedian;
  std::vector<double> out;
  for (std::size_t k = 0; k < amounts.size(); k += stride) out.push_back(amounts[k]);
  return out;
}

}  // namespace

template <int Dim>
ProfilePool<Dim>::ProfilePool(const fem::Geometry<Dim>& geometry, double pool_mm)
    : factor_(pool_matrix<Dim>(geometry, pool_mm)),
      // Cells of a kernel that falls off like exp(-r / pool): 4 pi pool^2 or 4 pool of them count.
      area_mm_(std::min(Dim == 3 ? 4 * std::numbers::pi * pool_mm * pool_mm : 4 * pool_mm,
                        geometry.measure())) {}

template <int Dim>
ExpectedValue expected_value(const EdgeProfiles& profiles, const EdgeCell<Dim>& cell,
                             const Elements<Dim>& T, double distance_mm) {
  double inside = 0, outside = 0, width = 0;
  ExpectedValue out;
  for (int i = 0; i < Dim; ++i) {
    const int vertex = T(cell.element, i);
    inside += cell.lambda[i] * profiles.inside[vertex];
    outside += cell.lambda[i] * profiles.outside[vertex];
    width += cell.lambda[i] * profiles.width_mm[vertex];
    out.noise += cell.lambda[i] * profiles.noise[vertex];
  }
  const double z = distance_mm / width;
  out.value = (inside + outside) / 2 + (outside - inside) / 2 * erf_step(z);
  out.slope = (outside - inside) * normal_density(z) / width;
  return out;
}

template <int Dim>
EdgeProfiles fit_edge_profiles(const fem::Geometry<Dim>& geometry, const EdgeCells<Dim>& cells,
                               const Eigen::VectorXd& moved_mm, const ProfilePool<Dim>& pool,
                               const ProfileOptions& options, const Eigen::VectorXd& misfit) {
  const Elements<Dim>& T = geometry.elements();
  const Eigen::Index n = geometry.n_vertices();
  const double bin_mm = 2 * options.reach_mm / kBins;
  std::vector<double> moved(cells.size());  // distances
  tbb::parallel_for(std::size_t(0), cells.size(),
                    [&](std::size_t k) { moved[k] = distance_after<Dim>(cells[k], T, moved_mm); });
  // Sums over the cells of each bin: of 1, of the distances and of the values.
  Eigen::MatrixXd sums(n, 3 * kBins);
  tbb::parallel_for(Eigen::Index(0), n, [&](Eigen::Index i) {
    Eigen::Array<double, kBins, 3> of_vertex = Eigen::Array<double, kBins, 3>::Zero();
    cells.for_each_round(i, [&](std::size_t k, int corner) {
      const int bin = int(std::floor((moved[k] + options.reach_mm) / bin_mm));
      if (bin < 0 || bin >= kBins) return;
      const double lambda = cells[k].lambda[corner];
      of_vertex(bin, 0) += lambda;
      of_vertex(bin, 1) += lambda * moved[k];
      of_vertex(bin, 2) += lambda * cells[k].value;
    });
    sums.row(i) = of_vertex.reshaped().transpose();
  });
  // Of values less their mean, so that rounding does not matter.
  const double middle = sums.rightCols(kBins).sum() / std::max(sums.leftCols(kBins).sum(), 1.0);
  sums.rightCols(kBins) -= middle * sums.leftCols(kBins);
  const Eigen::MatrixXd pooled = pool(sums);
  const auto counts = pooled.leftCols(kBins), distances = pooled.middleCols(kBins, kBins),
             values = pooled.rightCols(kBins);
  EdgeProfiles out;
  for (Eigen::VectorXd* field : {&out.inside, &out.outside, &out.width_mm, &out.place_mm,
                                 &out.noise, &out.explained, &out.n_cells, &out.misfit})
    field->setZero(n);
  const auto fit = [&](Eigen::Index i) {
    Bins bins;  // weights: cells
    int n_bins = 0;
    double mean = 0, total = 0;
    for (int k = 0; k < kBins; ++k) {
      if (!(counts(i, k) > kLeastCells)) continue;
      ++n_bins;
      bins.distance[k] = distances(i, k) / counts(i, k);
      bins.mean[k] = values(i, k) / counts(i, k);
      bins.weight[k] = counts(i, k);
      mean += values(i, k);
      total += counts(i, k);
    }
    out.width_mm[i] = options.width_mm;
    out.n_cells[i] = total;
    if (n_bins < 5) return;
    mean /= total;
    double variance = 0, inner = 0, outer = 0, n_inner = 0, n_outer = 0;
    for (int k = 0; k < kBins; ++k) {
      variance += bins.weight[k] * std::pow(bins.mean[k] - mean, 2) / total;
      (bins.distance[k] < 0 ? inner : outer) += bins.weight[k] * bins.mean[k];
      (bins.distance[k] < 0 ? n_inner : n_outer) += bins.weight[k];
    }
    inner = n_inner > 0 ? inner / n_inner : mean;
    outer = n_outer > 0 ? outer / n_outer : mean;
    // The solver ends by the relative change of all parameters: levels of 1e7 would hide places.
    const double unit = unit_of(std::max(std::abs(outer - inner), std::sqrt(variance)));
    Eigen::Vector4d x(((inner + outer) / 2 - mean) / unit, (outer - inner) / 2 / unit, 0,
                      std::log(options.width_mm));
    // Weights by the deviation of a bin's mean: of what the fit before has left; at first of all
    // bins, then of what that leaves.
    const bool is_first = misfit.size() == 0 || !(misfit[i] > 0);
    double deviation = is_first ? std::max(std::sqrt(variance), options.least_noise) : misfit[i];
    double left = 0;
    Bins weighted = bins;
    for (int round = is_first ? 0 : 1; round < 2; ++round) {
      for (int k = 0; k < kBins; ++k) {
        if (bins.weight[k] == 0) continue;
        weighted.mean[k] = (bins.mean[k] - mean) / unit;
        weighted.weight[k] =
            unit / std::hypot(deviation / std::sqrt(bins.weight[k] / total * n_bins),
                              kBinShare * std::abs(outer - inner) + 1e-300);
      }
      const ProfileCost cost(weighted, options);
      ceres::TinySolver<ProfileCost> solver;
      solver.options.max_num_iterations = 25;
      solver.options.function_tolerance = kTolerance;
      solver.Solve(cost, &x);
      const StepsAndDensities at((bins.distance - x[2]) / std::exp(x[3]));
      const Rows off = (x[0] + x[1] * at.step) * unit + mean - bins.mean,
                 share = bins.weight / total;
      left = (share * off.square()).sum();
      std::vector<double> amounts;
      for (int k = 0; k < kBins; ++k)
        if (share[k] > 0) amounts.push_back(std::abs(off[k]) * std::sqrt(share[k] * n_bins));
      deviation = std::max(robust_deviation(std::move(amounts)), options.least_noise / 10);
    }
    out.misfit[i] = deviation;
    out.inside[i] = (x[0] - x[1]) * unit + mean + middle;
    out.outside[i] = (x[0] + x[1]) * unit + mean + middle;
    out.place_mm[i] = x[2];
    out.width_mm[i] = std::exp(x[3]);
    out.explained[i] = variance > 0 ? 1 - left / variance : 0;
  };
  tbb::parallel_for(Eigen::Index(0), n, fit);
  // What single cells have besides.
  std::vector<double> amounts(cells.size());  // of residuals
  tbb::parallel_for(std::size_t(0), cells.size(), [&](std::size_t k) {
    const EdgeCell<Dim>& cell = cells[k];
    double place = 0;
    for (int i = 0; i < Dim; ++i) place += cell.lambda[i] * out.place_mm[T(cell.element, i)];
    amounts[k] = std::abs(cell.value - expected_value<Dim>(out, cell, T, moved[k] - place).value);
  });
  const double typical = std::max(robust_deviation(some_of(amounts)), options.least_noise);
  Eigen::MatrixXd squares(n, 2);
  tbb::parallel_for(Eigen::Index(0), n, [&](Eigen::Index i) {
    double sum = 0, number = 0;
    cells.for_each_round(i, [&](std::size_t k, int corner) {
      const double r = std::min(amounts[k], kFarOff * typical);
      sum += cells[k].lambda[corner] * r * r;
      number += cells[k].lambda[corner];
    });
    squares.row(i) << sum, number;
  });
  squares = pool(squares).cwiseMax(0);
  for (Eigen::Index i = 0; i < n; ++i)
    out.noise[i] =
        std::max(squares(i, 1) > kLeastCells ? std::sqrt(squares(i, 0) / squares(i, 1)) : typical,
                 options.least_noise);
  return out;
}

template <int Dim>
std::vector<char> have_own_steps(const fem::Geometry<Dim>& geometry, const EdgeCells<Dim>& cells,
                                 const EdgeProfiles& profiles, const Eigen::VectorXd& u) {
  const Elements<Dim>& T = geometry.elements();
  std::vector<char> out(std::size_t(u.size()), 1);
  tbb::parallel_for(Eigen::Index(0), u.size(), [&](Eigen::Index i) {
    Eigen::Array2d sum = Eigen::Array2d::Zero(), n = sum;  // of inner and outer cells
    cells.for_each_round(i, [&](std::size_t k, int) {
      const double d = distance_after<Dim>(cells[k], T, u);
      if (std::abs(d) < profiles.width_mm[i]) return;
      sum[d > 0] += cells[k].value;
      n[d > 0] += 1;
    });
    if (n.minCoeff() < kFewCells) return;
    const double step =
        (sum[1] / n[1] - sum[0] / n[0]) / (profiles.outside[i] - profiles.inside[i]);
    out[std::size_t(i)] = step >= kOwnShare;
  });
  // Alone among others without, a step is noise.
  Eigen::ArrayXd own = Eigen::ArrayXd::Zero(u.size()), all = own;
  for (const auto corners : T.rowwise())
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j) {
        own[corners[i]] += out[std::size_t(corners[j])];
        all[corners[i]] += 1;
      }
  for (Eigen::Index i = 0; i < u.size(); ++i)
    if (own[i] < kOwnAround * all[i]) out[std::size_t(i)] = 0;
  return out;
}

#define SURFSEG_INSTANTIATE(Dim)                                                                   \
  template class ProfilePool<Dim>;                                                                 \
  template ExpectedValue expected_value<Dim>(const EdgeProfiles&, const EdgeCell<Dim>&,            \
                                             const Elements<Dim>&, double);                        \
  template EdgeProfiles fit_edge_profiles<Dim>(const fem::Geometry<Dim>&, const EdgeCells<Dim>&,   \
                                               const Eigen::VectorXd&, const ProfilePool<Dim>&,    \
                                               const ProfileOptions&, const Eigen::VectorXd&);     \
  template std::vector<char> have_own_steps<Dim>(const fem::Geometry<Dim>&, const EdgeCells<Dim>&, \
                                                 const EdgeProfiles&, const Eigen::VectorXd&);
SURFSEG_INSTANTIATE(2)
SURFSEG_INSTANTIATE(3)

}  // namespace surf::segment
