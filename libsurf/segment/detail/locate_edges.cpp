#include "libsurf/segment/detail/locate_edges.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "libsurf/segment/detail/bend_doubt.h"
#include "libsurf/segment/detail/cell_noise.h"
#include "libsurf/segment/detail/edge_profiles.h"
#include "libsurf/segment/detail/facet_offsets.h"
#include "libsurf/segment/detail/faded_moves.h"
#include "libsurf/segment/detail/smooth_moves.h"

namespace surf::segment {
namespace {

constexpr double kReachBlurs = 3, kReachCells = 1.5;
constexpr double kPoolCells = 4;
constexpr int kPasses = 4;
// Of the prior: in the first pass, in those after it, which begin where the one before has ended,
// and where lengths are compared. With 3 everywhere errors on phantoms are the same to a thousandth
// of a voxel, for twice the time.
constexpr int kFirst = 3, kNext = 0, kCompared = 1;
constexpr std::array kLengths = {4.0, 6.0, 8.0, 12.0, 16.0, 24.0};  // cells
constexpr int kMiddle = 3;                                          // of the lengths
constexpr double kLevelShare = 0.6;    // of the cells tell levels apart from the place
constexpr double kClearStep = 8;       // deviations of the mean of all cells round a vertex
constexpr double kExplained = 0.5;     // of the profile's variance
constexpr double kBentDoubt = 0.1;     // of the content between flat elements and the bent shape
constexpr double kRoundedDoubt = 0.3;  // of the content of what may have been rounded off
constexpr double kCauchy = 2.385;  // deviations: 95 % as efficient as squares under normal noise
// Of the weights of a normal variable under this loss: their mean is 0.865, what they tell 0.95.
constexpr double kInformation = 0.95 / 0.865;
constexpr double kLeastNoise = 1e-3;  // of the image's range

double median(Eigen::VectorXd values) {
  if (values.size() == 0) return 0;
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The vertices' normals; on the border along it, 0 where only the border is.
template <int Dim>
Points<Dim> directions_of(const fem::Geometry<Dim>& geometry) {
  Points<Dim> out = geometry.directions();
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    if (const double norm = out.row(i).norm(); norm > 0) out.row(i) /= norm;
  return out;
}

template <int Dim>
class Locator {
 public:
  Locator(const Setting<Dim>& setting, const Simplices<Dim>& shape, double blur_mm,
          const std::vector<char>& is_held, const std::stop_token& stop)
      : setting_(setting),
        stop_(stop),
        geometry_(geometry_of(setting.extent(), shape, is_held)),
        normals_(directions_of<Dim>(geometry_)),
        cell_mm_(setting.extent().cell_mm()),
        blur_mm_(blur_mm),
        reach_mm_(kReachBlurs * blur_mm + kReachCells * cell_mm_),
        bending_(geometry_),
        pool_(geometry_, kPoolCells * cell_mm_),
        cells_(edge_cells<Dim>(setting, geometry_, normals_, reach_mm_, stop)) {}

  LocatedEdges<Dim> run() {
    const Eigen::Index n = geometry_.n_vertices();
    LocatedEdges<Dim> out;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
    ProfileOptions options;
    options.reach_mm = reach_mm_;
    options.width_mm = std::hypot(blur_mm_, 0.3 * cell_mm_);
    options.least_noise =
        kLeastNoise * (setting_.extent().range[1] - double(setting_.extent().range[0]));
    EdgeProfiles profiles;
    std::unique_ptr<Posterior> posterior;
    std::optional<SmoothMoves<Dim>> prior;
    for (int pass = 0; pass < kPasses; ++pass) {
      out.was_stopped = stop_.stop_requested();
      if (out.was_stopped) return out;
      profiles = fit_edge_profiles<Dim>(geometry_, cells_, u, pool_, options);
      if (pass == 0) {
        options.width_mm = median(profiles.width_mm);
        options.width_range = 1.25;
        u = limited(profiles.place_mm);
        continue;
      }
      const Expectations expected = expectations(profiles, u);
      out.correlation = expected.correlation;
      const Observations data = observations(expected, u, Part::kAll);
      if (pass == 1) {
        auto [length_mm, best] = best_prior(expected, u);
        out.was_stopped = stop_.stop_requested();
        if (out.was_stopped) return out;
        out.length_mm = length_mm;
        prior.emplace(std::move(best));
      }
      posterior =
          std::make_unique<Posterior>(posterior ? after(*prior, data, posterior->mean(), kNext)
                                                : after(*prior, data, prior->smoothing(), kFirst));
      u = limited(posterior->mean());
    }
    out.blur_mm = median(profiles.width_mm);
    out.noise = median(profiles.noise);
    judge(profiles, *posterior, u, out);
    out.points = geometry_.points() + u.asDiagonal() * normals_;
    return out;
  }

 private:
  static fem::Geometry<Dim> geometry_of(const ImageExtent<Dim>& extent, const Simplices<Dim>& shape,
                                        const std::vector<char>& is_held) {
    const fem::Border<Dim> border{extent.normals(), faces(extent, shape)};
    if (is_held.empty()) return {shape.points, shape.elements, border};
    return {shape.points, shape.elements, border, {is_held, 0}};
  }

  static std::vector<std::uint8_t> faces(const ImageExtent<Dim>& extent,
                                         const Simplices<Dim>& shape) {
    std::vector<std::uint8_t> out;
    for (const auto point : shape.points.rowwise()) out.push_back(extent.faces(point.transpose()));
    return out;
  }

  /// Fills in the certainty. Vertices without an edge follow those that have one nearby and stay
  /// where none is, see faded_moves().
  void judge(const EdgeProfiles& profiles, const Posterior& posterior, Eigen::VectorXd& u,
             LocatedEdges<Dim>& out) const {
    Certainty<Dim>& certainty = out.certainty;
    const Eigen::VectorXd& mass = geometry_.lumped_mass();
    const Eigen::VectorXd height = (profiles.outside - profiles.inside).cwiseAbs();
    const Eigen::VectorXd offsets = facet_offsets<Dim>(geometry_, normals_);
    certainty.edge_strength = height.cwiseQuotient(profiles.noise);
    // Levels that are off by dm move the step by 2 sqrt(pi) w dm / height.
    const Eigen::VectorXd by_level =
        (2 * std::sqrt(std::numbers::pi) * profiles.width_mm.array() / height.array().max(1e-300) *
         profiles.noise.array() *
         (out.correlation / (kLevelShare * profiles.n_cells.array().max(1))).sqrt());
    // A pull of the prior that the noise does not explain is bias: it rounds edges off.
    const Eigen::ArrayXd by_place =
        posterior.variances().array().max(posterior.pull().array().square());
    certainty.deviation_mm =
        with_facet_offset((by_place + by_level.array().square()).sqrt().matrix(), offsets);
    const Eigen::VectorXd by_bend =
        bend_doubts<Dim>(geometry_.moved_to(geometry_.points() + u.asDiagonal() * normals_),
                         cell_mm_, out.length_mm);
    certainty.has_edge.assign(std::size_t(u.size()), 0);
    Eigen::VectorXd counted = mass;
    const double pool = kPoolCells * cell_mm_;
    const double pool_area =
        std::min(Dim == 3 ? 4 * std::numbers::pi * pool * pool : 4 * pool, geometry_.measure());
    double variance = 0, doubtful = 0, bent = 0, rounded = 0;
    std::vector<char> on_border(std::size_t(u.size()), 0);
    const std::vector<char> is_own = have_own_steps<Dim>(geometry_, cells_, profiles, u);
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      if (normals_.row(i).isZero()) {
        on_border[std::size_t(i)] = 1;
        certainty.deviation_mm[i] = certainty.edge_strength[i] = u[i] = counted[i] = 0;
        continue;
      }
      const double step = height[i] / std::max(profiles.noise[i], 1e-300) *
                          std::sqrt(profiles.n_cells[i] / out.correlation);
      const bool has_edge =
          step >= kClearStep && is_own[std::size_t(i)] && profiles.explained[i] >= kExplained &&
          std::abs(profiles.place_mm[i]) <= profiles.width_mm[i] &&
          std::abs(u[i]) < reach_mm_ / 2 && certainty.deviation_mm[i] < reach_mm_ / 2;
      certainty.has_edge[std::size_t(i)] = has_edge;
      if (has_edge) {
        certainty.deviation_mm[i] = std::hypot(certainty.deviation_mm[i], by_bend[i]);
        variance += mass[i] * pool_area * by_level[i] * by_level[i];
        bent += mass[i] * std::abs(offsets[i]);
        rounded += mass[i] * by_bend[i];
        continue;
      }
      counted[i] = 0;
      certainty.deviation_mm[i] = reach_mm_;
      doubtful += mass[i] * reach_mm_;
    }
    u = faded_moves<Dim>(geometry_, u, certainty.has_edge, reach_mm_);
    variance += posterior.variance_of(counted) + std::pow(kBentDoubt * bent, 2) +
                std::pow(kRoundedDoubt * rounded, 2);
    certainty.content_deviation = std::hypot(std::sqrt(std::max(variance, 0.0)), doubtful);
    find_doubt<Dim>({geometry_.points() + u.asDiagonal() * normals_, geometry_.elements()},
                    on_border, certainty);
  }

  enum class Part { kAll, kOne, kOther };

  /// Of the cells, by profiles round moved vertices.
  struct Expectations {
    std::vector<ExpectedValue> values;
    std::vector<double> residuals;  // in deviations
    double correlation = 1;
  };

  /// @param moves  that the prior's first weights are of
  Posterior after(const SmoothMoves<Dim>& prior, const Observations& data,
                  const Eigen::VectorXd& moves, int n_reweightings) const {
    const Eigen::VectorXd information =
        (data.P * Eigen::VectorXd::Ones(data.b.size()))
            .cwiseQuotient(geometry_.lumped_mass().cwiseMax(1e-300));
    // Of the vertices that see cells: those on the image's border do not.
    std::vector<double> seen;
    for (const double one : information)
      if (one > 0) seen.push_back(one);
    const auto n_seen = Eigen::Index(seen.size());
    const double tau = prior.stiffness(
        n_seen == 0 ? 1 : median(Eigen::Map<const Eigen::VectorXd>(seen.data(), n_seen)));
    Eigen::VectorXd weights = prior.weights(moves, tau);
    for (int round = 0;; ++round) {
      Posterior out(bending_.cholesky(), prior.precision(tau, weights), data, prior.smoothing());
      if (round == n_reweightings || stop_.stop_requested()) return out;
      weights = prior.weights(out.mean(), tau);
    }
  }

  /// The prior of the length [mm] that predicts one half of the cells best from the other: found
  /// from the middle, to the side where it gets better. A shorter one is better only if both halves
  /// say so: what they do not agree on is noise, and a longer one tells more of it from the shape.
  std::pair<double, SmoothMoves<Dim>> best_prior(const Expectations& expected,
                                                 const Eigen::VectorXd& u) const {
    std::array<Observations, 2> parts;
    tbb::parallel_for(0, 2, [&](int half) {
      parts[half] = observations(expected, u, half == 0 ? Part::kOne : Part::kOther);
    });
    std::array<std::optional<SmoothMoves<Dim>>, kLengths.size()> priors;
    std::array<std::array<double, 2>, kLengths.size()> losses{};
    const auto compare = [&](int first, int n) {
      tbb::parallel_for(0, n, [&](int k) {
        const SmoothMoves<Dim>& prior = priors[first + k].emplace(bending_, geometry_, normals_,
                                                                  kLengths[first + k] * cell_mm_);
        tbb::parallel_for(0, 2, [&](int half) {
          if (stop_.stop_requested()) return;
          // Moves further than they are allowed to go say nothing of the length.
          const Eigen::VectorXd moves =
              limited(after(prior, parts[half], prior.smoothing(), kCompared).mean());
          losses[first + k][half] =
              moves.dot(parts[1 - half].P * moves) / 2 - parts[1 - half].b.dot(moves);
        });
      });
    };
    const auto is_better = [&](int shorter, int longer) {
      return losses[shorter][0] < losses[longer][0] && losses[shorter][1] < losses[longer][1];
    };
    compare(kMiddle - 1, 2);
    const int step = is_better(kMiddle - 1, kMiddle) ? -1 : 1;
    int best = step == 1 ? kMiddle : kMiddle - 1;
    for (int next = best + step;
         !stop_.stop_requested() && next >= 0 && next < int(kLengths.size()); next += step) {
      compare(next, 1);
      if (step == 1 ? is_better(best, next) : !is_better(next, best)) break;
      best = next;
    }
    return {kLengths[best] * cell_mm_, *std::move(priors[best])};
  }

  Eigen::VectorXd limited(const Eigen::VectorXd& moves) const {
    return moves.cwiseMax(-reach_mm_ / 2).cwiseMin(reach_mm_ / 2);
  }

  Part part_of(const EdgeCell<Dim>& cell, double correlation) const {
    return is_in_first_half<Dim>(cell.index, setting_.extent().size, correlation) ? Part::kOne
                                                                                  : Part::kOther;
  }

  Expectations expectations(const EdgeProfiles& profiles, const Eigen::VectorXd& u) const {
    const Elements<Dim>& T = geometry_.elements();
    Expectations out;
    out.values.resize(cells_.size());
    out.residuals.resize(cells_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells_.size()), [&](const auto& range) {
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        out.values[k] =
            expected_value<Dim>(profiles, cells_[k], T, distance_after<Dim>(cells_[k], T, u));
        out.residuals[k] = (cells_[k].value - out.values[k].value) / out.values[k].noise;
      }
    });
    out.correlation = noise_correlation<Dim>(cells_, out.residuals, setting_.extent().size);
    return out;
  }

  /// What the cells say of the moves: Gauss-Newton round u, Cauchy's loss by its weights.
  Observations observations(const Expectations& expected, const Eigen::VectorXd& u,
                            Part part) const {
    const Elements<Dim>& T = geometry_.elements();
    const fem::Topology<Dim>& topology = geometry_.topology();
    Observations out;
    out.b.setZero(geometry_.n_vertices());
    SparseMatrix P = topology.pattern();
    double* entries = P.valuePtr();
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      const EdgeCell<Dim>& cell = cells_[k];
      if (part != Part::kAll && part != part_of(cell, expected.correlation)) continue;
      const double residual = expected.residuals[k];
      const double slope = expected.values[k].slope / expected.values[k].noise;  // by the distance
      const double q = residual / kCauchy;
      const double weight = kInformation / (1 + q * q) / expected.correlation;
      double target = residual;  // r = I - f(d - reach . u); df / du_i = -slope reach_i
      for (int i = 0; i < Dim; ++i) target -= slope * cell.reach[i] * u[T(cell.element, i)];
      for (int i = 0; i < Dim; ++i) {
        const double gi = -slope * cell.reach[i];
        out.b[T(cell.element, i)] += weight * gi * target;
        for (int j = 0; j < Dim; ++j)
          entries[topology.slot(cell.element, i, j)] += -weight * gi * slope * cell.reach[j];
      }
    }
    out.P = P;
    return out;
  }

  const Setting<Dim>& setting_;
  std::stop_token stop_;
  fem::Geometry<Dim> geometry_;
  Points<Dim> normals_;
  double cell_mm_, blur_mm_, reach_mm_;
  BendingMatrices bending_;
  ProfilePool<Dim> pool_;
  std::vector<EdgeCell<Dim>> cells_;
};

}  // namespace

template <int Dim>
LocatedEdges<Dim> locate_edges(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                               double blur_mm, const std::vector<char>& is_held,
                               const std::stop_token& stop) {
  return Locator<Dim>(setting, shape, blur_mm, is_held, stop).run();
}

template LocatedEdges<2> locate_edges<2>(const Setting<2>&, const Segments&, double,
                                         const std::vector<char>&, const std::stop_token&);
template LocatedEdges<3> locate_edges<3>(const Setting<3>&, const Triangles&, double,
                                         const std::vector<char>&, const std::stop_token&);

}  // namespace surf::segment
