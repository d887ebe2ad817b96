#include "libsurf/segment/detail/locate_edges.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "libsurf/segment/detail/bend_doubt.h"
#include "libsurf/segment/detail/cell_noise.h"
#include "libsurf/segment/detail/choose_prior.h"
#include "libsurf/segment/detail/edge_profiles.h"
#include "libsurf/segment/detail/facet_offsets.h"
#include "libsurf/segment/detail/faded_moves.h"
#include "libsurf/segment/detail/smooth_moves.h"

namespace surf::segment {
namespace {

constexpr double kReachBlurs = 3, kReachCells = 1.5;
constexpr double kBlockBlurs = 1, kBlockEdges = 0.5;  // a block's side at most
constexpr int kLeastBlocks = 8;                       // along each axis of the image
constexpr double kLeastBlurOfBlocks = 0.6;            // sides: that of all edges at the median
constexpr double kPoolCells = 4;
// At most; each takes the prior's weights from the moves of the one before. With four such
// reweightings in the first and two in the others errors on phantoms are the same to a thousandth
// of a voxel, with one in the first to one unit of the last digit of docs/method.md.
constexpr int kPasses = 4;
constexpr double kAtRest = 0.01;     // cells: where no vertex moves further there is no other pass
constexpr double kLevelShare = 0.6;  // of the cells tell levels apart from the place
constexpr double kClearStep = 8;     // deviations of the mean of all cells round a vertex
constexpr double kExplained = 0.5;   // of the profile's variance
constexpr double kBentDoubt = 0.1;   // of the content between flat elements and the bent shape
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

/// Where the blur is as wide as several cells, blocks of them tell as much: the side of a block in
/// cells.
template <int Dim>
int cells_along_block(const ImageExtent<Dim>& extent, const fem::Geometry<Dim>& geometry,
                      double blur_mm) {
  const double spacing_mm = extent.index_to_world.linear().colwise().norm().maxCoeff();
  const double element_mm = geometry.measure() / double(geometry.n_elements());
  const double edge_mm = Dim == 3 ? std::sqrt(4 / std::sqrt(3.0) * element_mm) : element_mm;
  const double side_mm = std::min(kBlockBlurs * blur_mm, kBlockEdges * edge_mm);
  const int shortest = *std::min_element(extent.size.begin(), extent.size.end());
  return std::clamp(int(side_mm / spacing_mm), 1, std::max(1, shortest / kLeastBlocks));
}

template <int Dim>
class Locator {
 public:
  /// @param most_side  of the blocks [cells]
  Locator(const Setting<Dim>& setting, const Simplices<Dim>& shape, double blur_mm,
          const std::vector<char>& is_held, int most_side, const std::stop_token& stop)
      : setting_(setting),
        stop_(stop),
        geometry_(geometry_of(setting.extent(), shape, is_held)),
        normals_(directions_of<Dim>(geometry_)),
        blocks_(setting.extent(),
                std::min(most_side, cells_along_block<Dim>(setting.extent(), geometry_, blur_mm))),
        cell_mm_(blocks_.side * setting.extent().cell_mm()),
        blur_mm_(blur_mm),
        reach_mm_(kReachBlurs * blur_mm + kReachCells * cell_mm_) {
    tbb::parallel_invoke(
        [&] { bending_.emplace(geometry_); },
        [&] { pool_.emplace(geometry_, kPoolCells * cell_mm_); },
        [&] { cells_ = edge_cells<Dim>(setting, geometry_, normals_, reach_mm_, blocks_, stop); });
  }

  /// Nothing if the edges turn out to be too narrow for the blocks.
  std::optional<LocatedEdges<Dim>> run() {
    const Eigen::Index n = geometry_.n_vertices();
    LocatedEdges<Dim> out;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(n);
    ProfileOptions options;
    options.reach_mm = reach_mm_;
    options.width_mm = std::hypot(blur_mm_, 0.3 * cell_mm_);
    options.least_noise = kLeastNoise * setting_.extent().width();
    EdgeProfiles profiles;
    std::unique_ptr<Posterior> after;
    std::optional<SmoothMoves<Dim>> prior;
    for (int pass = 0; pass < kPasses; ++pass) {
      out.was_stopped = stop_.stop_requested();
      if (out.was_stopped) return out;
      // Where the first fit was made says little of how well the others will do.
      profiles = fit_edge_profiles<Dim>(geometry_, cells_, u, *pool_, options,
                                        pass < 2 ? Eigen::VectorXd() : profiles.misfit);
      if (pass == 0) {
        options.width_mm = median(profiles.width_mm);
        if (blocks_.side > 1 && options.width_mm < kLeastBlurOfBlocks * cell_mm_)
          return std::nullopt;
        options.width_range = 1.25;
        u = limited(profiles.place_mm);
        continue;
      }
      const Expectations expected = expectations(profiles, u);
      out.correlation = expected.correlation;
      const Observations data = observations(expected, u, Part::kAll);
      if (pass == 1) {
        PriorChoice<Dim> chosen = prior_of(expected, u);
        out.was_stopped = stop_.stop_requested();
        if (out.was_stopped) return out;
        out.length_mm = chosen.length_mm;
        prior.emplace(std::move(chosen.prior));
      }
      after = std::make_unique<Posterior>(posterior<Dim>(
          *prior, *bending_, geometry_, data, after ? after->mean() : prior->smoothing()));
      const Eigen::VectorXd before = std::exchange(u, limited(after->mean()));
      if ((u - before).cwiseAbs().maxCoeff() <= kAtRest * cell_mm_) break;
    }
    const Eigen::VectorXd noise = noise_of_cells(profiles, u);
    out.blur_mm =
        std::sqrt(std::max(0.0, std::pow(median(profiles.width_mm), 2) - block_variance()));
    out.noise = median(noise);
    judge(profiles, noise, *after, u, out);
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

  /// That blocks add to the blur [mm^2].
  double block_variance() const {
    const double cell_mm = cell_mm_ / blocks_.side;
    return (double(blocks_.side) * blocks_.side - 1) * cell_mm * cell_mm / 12;
  }

  /// Deviation of single cells [intensity], (n): besides that of the blocks' means what the values
  /// in them vary by more than the step's slope explains.
  Eigen::VectorXd noise_of_cells(const EdgeProfiles& profiles, const Eigen::VectorXd& u) const {
    if (blocks_.side == 1) return profiles.noise;
    const Elements<Dim>& T = geometry_.elements();
    Eigen::MatrixXd within(u.size(), 2);  // sums and numbers
    tbb::parallel_for(Eigen::Index(0), u.size(), [&](Eigen::Index i) {
      double sum = 0, number = 0;
      cells_.for_each_round(i, [&](std::size_t k, int corner) {
        const EdgeCell<Dim>& cell = cells_[k];
        const double slope =
            expected_value<Dim>(profiles, cell, T, distance_after<Dim>(cell, T, u)).slope;
        sum += cell.lambda[corner] * (cell.variance - slope * slope * block_variance());
        number += cell.lambda[corner];
      });
      within.row(i) << sum, number;
    });
    within = (*pool_)(within);
    Eigen::VectorXd out = profiles.noise;
    for (Eigen::Index i = 0; i < out.size(); ++i)
      if (within(i, 1) > 0.5)
        out[i] = std::sqrt(out[i] * out[i] + std::max(0.0, within(i, 0) / within(i, 1)));
    return out;
  }

  /// Fills in the certainty. Vertices without an edge follow those that have one nearby and stay
  /// where none is, see faded_moves().
  void judge(const EdgeProfiles& profiles, const Eigen::VectorXd& noise_of_cells,
             const Posterior& posterior, Eigen::VectorXd& u, LocatedEdges<Dim>& out) const {
    Certainty<Dim>& certainty = out.certainty;
    const Eigen::VectorXd& mass = geometry_.lumped_mass();
    const Eigen::VectorXd height = (profiles.outside - profiles.inside).cwiseAbs();
    const Eigen::VectorXd offsets = facet_offsets<Dim>(geometry_, normals_);
    certainty.edge_strength = height.cwiseQuotient(noise_of_cells);
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

  PriorChoice<Dim> prior_of(const Expectations& expected, const Eigen::VectorXd& u) const {
    std::array<Observations, 2> halves;
    tbb::parallel_for(0, 2, [&](int half) {
      halves[half] = observations(expected, u, half == 0 ? Part::kOne : Part::kOther);
    });
    return choose_prior<Dim>(geometry_, *bending_, normals_, halves, u, cell_mm_, reach_mm_ / 2,
                             stop_);
  }

  Eigen::VectorXd limited(const Eigen::VectorXd& moves) const {
    return moves.cwiseMax(-reach_mm_ / 2).cwiseMin(reach_mm_ / 2);
  }

  Part part_of(const EdgeCell<Dim>& cell, double correlation) const {
    return is_in_first_half<Dim>(cell.index, blocks_.box.size, correlation) ? Part::kOne
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
    out.correlation = noise_correlation<Dim>(cells_, out.residuals, blocks_.box.size);
    return out;
  }

  /// What the cells say of the moves: Gauss-Newton round u, Cauchy's loss by its weights.
  Observations observations(const Expectations& expected, const Eigen::VectorXd& u,
                            Part part) const {
    const Elements<Dim>& T = geometry_.elements();
    struct OfElement {
      Eigen::Matrix<double, Dim, Dim> P = Eigen::Matrix<double, Dim, Dim>::Zero();
      Vector<Dim> b = Vector<Dim>::Zero();
    };
    std::vector<OfElement> parts(std::size_t(T.rows()));
    tbb::parallel_for(Eigen::Index(0), T.rows(), [&](Eigen::Index t) {
      OfElement& sums = parts[std::size_t(t)];
      cells_.for_each_beside(t, [&](std::size_t k) {
        const EdgeCell<Dim>& cell = cells_[k];
        if (part != Part::kAll && part != part_of(cell, expected.correlation)) return;
        const double residual = expected.residuals[k];
        const double slope = expected.values[k].slope / expected.values[k].noise;  // by distance
        const double q = residual / kCauchy;
        const double weight = kInformation / (1 + q * q) / expected.correlation;
        Vector<Dim> g;  // r = I - f(d - reach . u), f its value there; g_i = df / du_i
        double target = residual;
        for (int i = 0; i < Dim; ++i) {
          g[i] = -slope * cell.reach[i];
          target += g[i] * u[T(t, i)];
        }
        sums.b += weight * target * g;
        sums.P += weight * g * g.transpose();
      });
    });
    const fem::Topology<Dim>& topology = geometry_.topology();
    Observations out;
    out.b.setZero(geometry_.n_vertices());
    SparseMatrix P = topology.pattern();
    double* entries = P.valuePtr();
    for (Eigen::Index t = 0; t < T.rows(); ++t)
      for (int i = 0; i < Dim; ++i) {
        out.b[T(t, i)] += parts[std::size_t(t)].b[i];
        for (int j = 0; j < Dim; ++j)
          entries[topology.slot(t, i, j)] += parts[std::size_t(t)].P(i, j);
      }
    out.P = P;
    return out;
  }

  const Setting<Dim>& setting_;
  std::stop_token stop_;
  fem::Geometry<Dim> geometry_;
  Points<Dim> normals_;
  CellBlocks<Dim> blocks_;
  double cell_mm_, blur_mm_, reach_mm_;  // a block counts as a cell
  std::optional<BendingMatrices> bending_;
  std::optional<ProfilePool<Dim>> pool_;
  EdgeCells<Dim> cells_;
};

}  // namespace

template <int Dim>
LocatedEdges<Dim> locate_edges(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                               double blur_mm, const std::vector<char>& is_held,
                               const std::stop_token& stop) {
  const auto with = [&](int most_side) {
    return Locator<Dim>(setting, shape, blur_mm, is_held, most_side, stop).run();
  };
  auto out = with(std::numeric_limits<int>::max());
  return out ? *std::move(out) : *with(1);
}

template LocatedEdges<2> locate_edges<2>(const Setting<2>&, const Segments&, double,
                                         const std::vector<char>&, const std::stop_token&);
template LocatedEdges<3> locate_edges<3>(const Setting<3>&, const Triangles&, double,
                                         const std::vector<char>&, const std::stop_token&);

}  // namespace surf::segment
