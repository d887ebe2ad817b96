#include "libsurf/segment/ladder.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numbers>

#include "libsurf/base/log.h"

namespace surf::segment {
namespace {

constexpr double kExplosion = 1.4;      // growth that counts as a leak
constexpr double kLargestGrowth = 1.4;  // growth_out of a rung before a leak
// Radii of discs [pixels]:
constexpr double kLeastRadius = 3;   // smaller is not judged
constexpr double kLeakFrom = 16.84;  // growth of what is smaller is no leak
constexpr double kCalmFrom = 16.84;  // a rung of more ends where the next is rough
constexpr double kLargestContact =
    0.05;  // share of the length held: the front meets itself round holes
constexpr double kLeastSphericity = 0.2;  // rougher curves percolate through noise

double area_of_disc(double radius) { return std::numbers::pi * radius * radius; }

/// ln of the ratio of the volumes of balls whose sections have these areas.
double growth(double from, double to) { return 1.5 * std::log(to / from); }

Eigen::VectorXd sample_shifted(const Field<2>& I, const fem::Geometry<2>& shape,
                               const Points<2>& unit_normals, double shift_mm) {
  Samples<2> samples;
  I.sample(shape.points() + shift_mm * unit_normals, Derivatives::kNone, samples);
  return samples.value;
}

std::vector<float> joined(const std::vector<Eigen::VectorXd>& parts) {
  std::vector<float> out;
  for (const auto& part : parts)
    for (const double value : part) out.push_back(static_cast<float>(value));
  return out;
}

/// Length of the circle of equal area over the shape's.
double sphericity(const fem::Geometry<2>& shape) {
  return 2 * std::numbers::pi * shape.radius() / shape.measure();
}

RungFeatures measure_rung(const EnergyModel<2>& model, const fem::Geometry<2>& shape,
                          double noise) {
  const double h = model.extent().cell_mm();
  Points<2> normals = shape.nodal_normals();
  for (Eigen::Index i = 0; i < normals.rows(); ++i) normals.row(i).normalize();
  // Intensities at -3.5 .. 3.5 pixels along the normal, every half pixel.
  std::vector<Eigen::VectorXd> profile;
  for (int s = -7; s <= 7; ++s)
    profile.push_back(sample_shifted(*model.intensity(), shape, normals, s * h / 2));
  RungFeatures features;
  features.enclosed = shape.enclosed();
  features.separation = histogram_separation(joined({profile[1], profile[3], profile[5]}),
                                             joined({profile[9], profile[10], profile[11]}));
  double on_edge = 0;
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
    const auto slope = [&](int s) { return std::abs(profile[s + 1][i] - profile[s - 1][i]); };
    int steepest = 1;
    for (int s = 1; s <= 13; ++s)
      if (slope(s) > slope(steepest)) steepest = s;
    // The steepest place of the profile lies within a pixel of the curve.
    if (std::abs(steepest - 7) <= 2 && slope(steepest) > 3 * noise)
      on_edge += shape.lumped_mass()[i];
  }
  features.edge_share = on_edge / shape.measure();
  features.sphericity = sphericity(shape);
  return features;
}

/// The rungs of one climb.
struct Rungs {
  std::string name;
  double neck_radius;  ///< [cells], of the start
  int end;             ///< rungs are 2 to end - 1
  std::function<std::vector<EnergyTerm>(int q)> terms;
};

/// Wider and wider windows.
Rungs window_rungs(const SeedModel& seed, double neck_radius, double cell_mm, int end) {
  return {fmt::format("ladder r={:.3g}", neck_radius * cell_mm), neck_radius, end,
          [seed, beta = neck_radius * cell_mm / 2](int q) -> std::vector<EnergyTerm> {
            const double half_width = seed.deviation * std::pow(2, q / 2.0);
            return {{"window", 1, {{"mean", seed.mean}, {"half-width", half_width}}},
                    {"area", beta, {}}};
          }};
}

/// Stronger and stronger balloons.
Rungs edge_rungs(double lambda, double cell_mm) {
  constexpr double kFirstGamma = 0.1;  // per cell
  constexpr double kStartRadius = 6;   // a circle of 1.4 times that grows by the second rung
  constexpr int kEnd = 8;
  return {
      fmt::format("ladder lambda={:.3g}", lambda), kStartRadius, kEnd,
      [=](int q) -> std::vector<EnergyTerm> {
        const double gamma = -kFirstGamma * std::pow(2, (q - 2) / 2.0) / cell_mm;
        return {{"minimal-surface", 1, {{"gamma0", 1.0}, {"gamma", gamma}, {"lambda", lambda}}}};
      }};
}

/// Everything one climb needs.
class Climb {
 public:
  Climb(const Setting<2>& setting, EnergyModel<2>& model, const SeedModel& seed,
        const Rungs& rungs_of_climb, const Segments& start, const LadderOptions& options,
        std::vector<StageReport>& stages, const ProgressOf<2>& progress)
      : setting_(setting),
        model_(model),
        seed_(seed),
        options_(options),
        stages_(stages),
        progress_(progress),
        rungs_(rungs_of_climb),
        start_(start) {
    restart();
  }

  void run(std::vector<CandidateOf<2>>& candidates) {
    std::vector<RungFeatures> rungs;
    std::vector<CandidateOf<2>> found;
    RungEnd end = RungEnd::kRest;
    for (int q = 2; q < rungs_.end; ++q) {
      end = grow(rungs_.terms(q), rungs.empty() ? 0 : rungs.back().enclosed, q);
      if (end == RungEnd::kStopped) {  // what has grown so far is a candidate, of no score
        rungs.emplace_back().enclosed = shape_->geometry().enclosed();
        found.push_back(
            {shape_->simplices(), 0, rungs.back().enclosed, rungs_.terms(q), stages_.back().name});
        break;
      }
      // Rough after a calm rung of some size: it leaks through its noise.
      if (end == RungEnd::kRough && !rungs.empty() && is_judged(rungs.back(), kCalmFrom)) break;
      if (end == RungEnd::kVanished || end == RungEnd::kRough) {  // try wider from the seed
        if (end == RungEnd::kRough) ++q;  // the scale of the noise is far below: twice as wide
        restart();
        continue;
      }
      if (end == RungEnd::kLeaked) {
        if (!rungs.empty()) rungs.back().growth_out = kLargestGrowth;
        break;
      }
      RungFeatures rung = measure_rung(model_, shape_->geometry(), seed_.noise);
      if (!rungs.empty()) {
        rung.growth_in = std::max(0.0, growth(rungs.back().enclosed, rung.enclosed));
        rungs.back().growth_out = std::min(kLargestGrowth, rung.growth_in);
      }
      rungs.push_back(rung);
      found.push_back(
          {shape_->simplices(), 0, rung.enclosed, rungs_.terms(q), stages_.back().name});
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].score = is_judged(rungs[i], kLeastRadius) ? rungs[i].score() : 0;
      log(LogLevel::kDebug,
          fmt::format("{} rung {:2} V {:12.1f} mm^n  O {:.2f} e {:.2f} Q {:.2f} b "
                      "{:.2f} g {:.2f}  score {:.3f}",
                      rungs_.name, i, rungs[i].enclosed, rungs[i].separation, rungs[i].edge_share,
                      rungs[i].sphericity, rungs[i].growth_in, rungs[i].growth_out,
                      found[i].score));
      candidates.push_back(std::move(found[i]));
    }
  }

 private:
  enum class RungEnd { kRest, kLeaked, kVanished, kRough, kStopped };

  /// Larger than a ball of this radius [cells]?
  bool is_judged(const RungFeatures& rung, double radius) const {
    return rung.enclosed > area_of_disc(radius * model_.extent().cell_mm());
  }

  void restart() {
    mesh::MovingShapeOptions<2> shape = options_.shape;
    shape.adaptivity.integrands = model_.integrands(rungs_.terms(0));
    shape_ = setting_.make_shape(start_, shape);
  }

  /// Large objects get longer edges, up to twice the first: their necks are wider too.
  void adapt_edge_length(double enclosed) {
    const double radius = std::sqrt(enclosed / area_of_disc(1));
    const double shortest = options_.shape.edge_length_mm;
    shape_->set_edge_length(std::clamp(radius / 20, shortest, 2 * shortest));
  }

  RungEnd grow(const std::vector<EnergyTerm>& terms, double enclosed_before, int q) {
    const auto energy = model_.energy(terms);
    shape_->set_integrands(model_.integrands(terms));
    const std::string stage = fmt::format("{} rung {}", rungs_.name, q - 1);
    const double start_content = fem::Geometry<2>(start_.points, start_.elements).enclosed();
    // A tiny first rung may fill a whole plateau at once.
    const bool may_leak = enclosed_before > area_of_disc(kLeakFrom * model_.extent().cell_mm());
    RungEnd end = RungEnd::kRest;
    const auto start = std::chrono::steady_clock::now();
    const auto on_step = [&](const flow::StepRecord& record) {
      if (progress_ && !progress_(stage, record, [&] { return shape_->simplices(); })) {
        end = RungEnd::kStopped;
        return false;
      }
      if (may_leak && growth(enclosed_before, record.enclosed) > kExplosion) {
        end = RungEnd::kLeaked;
        return false;
      }
      adapt_edge_length(record.enclosed);
      if (record.held_share > kLargestContact ||
          (record.k % 10 == 0 && sphericity(shape_->geometry()) < kLeastSphericity)) {
        end = RungEnd::kRough;
        return false;
      }
      return true;
    };
    StageReport report;
    report.name = stage;
    report.edge_length_mm = options_.shape.edge_length_mm;
    report.flow = flow::evolve<2>(*shape_, *energy, options_.flow, on_step);
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (report.flow.termination == flow::Termination::kObstacle)
      end = shape_->border_share() > 0.1 ? RungEnd::kLeaked : RungEnd::kVanished;
    if (end == RungEnd::kRest && shape_->geometry().enclosed() < 0.5 * start_content)
      end = RungEnd::kVanished;
    stages_.push_back(std::move(report));
    return end;
  }

  const Setting<2>& setting_;
  EnergyModel<2>& model_;
  const SeedModel& seed_;
  const LadderOptions& options_;
  std::vector<StageReport>& stages_;
  const ProgressOf<2>& progress_;
  Rungs rungs_;
  const Segments& start_;
  std::unique_ptr<mesh::MovingMesh<2>> shape_;
};

}  // namespace

std::vector<CandidateOf<2>> climb(const Setting<2>& setting, EnergyModel<2>& model,
                                  const SeedModel& seed, const Start& starts,
                                  const LadderOptions& options, std::vector<StageReport>& stages,
                                  const ProgressOf<2>& progress) {
  std::vector<Rungs> climbs;
  for (const double radius : options.neck_radii)
    climbs.push_back(window_rungs(seed, radius, model.extent().cell_mm(), options.max_rungs));
  for (const double lambda : options.edge_strengths) {
    climbs.push_back(edge_rungs(lambda, model.extent().cell_mm()));
    model.edge_indicator(lambda);  // the model's fields are not made by several threads at once
  }
  const int n = static_cast<int>(climbs.size());
  std::vector<std::vector<CandidateOf<2>>> found(n);
  std::vector<std::vector<StageReport>> reports(n);
  std::mutex mutex;
  const ProgressOf<2> one_at_a_time = [&](const auto& stage, const auto& record,
                                          const auto& shape) {
    const std::lock_guard lock(mutex);
    return !progress || progress(stage, record, shape);
  };
  tbb::parallel_for(0, n, [&](int i) {
    const Segments start = starts(climbs[i].neck_radius);
    Climb(setting, model, seed, climbs[i], start, options, reports[i], one_at_a_time).run(found[i]);
  });
  std::vector<CandidateOf<2>> candidates;
  for (int i = 0; i < n; ++i) {
    std::move(found[i].begin(), found[i].end(), std::back_inserter(candidates));
    std::move(reports[i].begin(), reports[i].end(), std::back_inserter(stages));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.score > b.score; });
  return candidates;
}

}  // namespace surf::segment
