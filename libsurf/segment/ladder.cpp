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

constexpr double kExplosion = 1.4;      // ln of the growth in volume that counts as a leak
constexpr double kLargestGrowth = 1.4;  // growth_out of a rung before a leak
constexpr double kLeastVolume = 113;    // voxels; a ball of radius 3: smaller is not judged
constexpr double kLeakFrom = 20000;     // voxels; growth of what is smaller is no leak
constexpr double kCalmFrom = 20000;     // voxels; a rung of more ends where the next is rough
constexpr double kLargestContact =
    0.05;  // share of the area held: the front meets itself round holes
constexpr double kLeastSphericity = 0.2;  // rougher surfaces percolate through noise

/// Histograms of intensities just inside and just outside, overlap sum min(p, q).
double histogram_separation(const Eigen::VectorXd& inside, const Eigen::VectorXd& outside) {
  constexpr int kBins = 32;
  std::vector<double> all(inside.data(), inside.data() + inside.size());
  all.insert(all.end(), outside.data(), outside.data() + outside.size());
  std::sort(all.begin(), all.end());
  const double low = all[all.size() / 100], high = all[all.size() - 1 - all.size() / 100];
  if (!(high > low)) return 0;
  const auto histogram = [&](const Eigen::VectorXd& values) {
    std::array<double, kBins> bins{};
    for (const double value : values)
      bins[std::clamp(int(kBins * (value - low) / (high - low)), 0, kBins - 1)] +=
          1.0 / double(values.size());
    return bins;
  };
  const auto p = histogram(inside), q = histogram(outside);
  double overlap = 0;
  for (int bin = 0; bin < kBins; ++bin) overlap += std::min(p[bin], q[bin]);
  return 1 - overlap;
}

Eigen::VectorXd sample_shifted(const Field<3>& I, const fem::Geometry<3>& shape,
                               const Points<3>& unit_normals, double shift_mm) {
  Samples<3> samples;
  I.sample(shape.points() + shift_mm * unit_normals, Derivatives::kNone, samples);
  return samples.value;
}

Eigen::VectorXd joined(const std::vector<Eigen::VectorXd>& parts) {
  Eigen::Index n = 0;
  for (const auto& part : parts) n += part.size();
  Eigen::VectorXd out(n);
  n = 0;
  for (const auto& part : parts) {
    out.segment(n, part.size()) = part;
    n += part.size();
  }
  return out;
}

/// Area of the ball of equal volume over the area.
double sphericity(const fem::Geometry<3>& shape) {
  const double r = shape.radius();
  return 4 * std::numbers::pi * r * r / shape.measure();
}

RungFeatures measure_rung(const ImageModel& model, const fem::Geometry<3>& shape, double noise) {
  const double h = model.volume().voxel_size();
  Points<3> normals = shape.nodal_normals();
  for (Eigen::Index i = 0; i < normals.rows(); ++i) normals.row(i).normalize();
  // Intensities at -3.5 .. 3.5 voxels along the normal, every half voxel.
  std::vector<Eigen::VectorXd> profile;
  for (int s = -7; s <= 7; ++s)
    profile.push_back(sample_shifted(*model.intensity(), shape, normals, s * h / 2));
  RungFeatures features;
  features.volume_mm3 = shape.enclosed();
  features.separation = histogram_separation(joined({profile[1], profile[3], profile[5]}),
                                             joined({profile[9], profile[10], profile[11]}));
  double on_edge = 0;
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
    const auto slope = [&](int s) { return std::abs(profile[s + 1][i] - profile[s - 1][i]); };
    int steepest = 1;
    for (int s = 1; s <= 13; ++s)
      if (slope(s) > slope(steepest)) steepest = s;
    // The steepest place of the profile lies within a voxel of the surface.
    if (std::abs(steepest - 7) <= 2 && slope(steepest) > 3 * noise)
      on_edge += shape.lumped_mass()[i];
  }
  features.edge_share = on_edge / shape.measure();
  features.sphericity = sphericity(shape);
  return features;
}

}  // namespace

double RungFeatures::score() const {
  return separation * edge_share * std::sqrt(std::clamp(sphericity, 0.0, 1.0)) * growth_out *
         std::exp(-growth_in / 4);
}

namespace {

/// Everything one climb with one neck radius needs.
class Climb {
 public:
  Climb(ImageModel& model, const SeedModel& seed, double neck_radius, const Triangles& start,
        const LadderOptions& options, std::vector<StageReport>& stages, const Progress& progress)
      : model_(model),
        seed_(seed),
        options_(options),
        stages_(stages),
        progress_(progress),
        beta_(neck_radius * model.volume().voxel_size() / 2),
        start_(start) {
    restart();
  }

  void run(std::vector<Candidate>& candidates) {
    std::vector<RungFeatures> rungs;
    std::vector<Candidate> found;
    RungEnd end = RungEnd::kRest;
    for (int q = 2; q < options_.max_rungs; ++q) {
      const double half_width = seed_.deviation * std::pow(2, q / 2.0);
      end = grow(half_width, rungs.empty() ? 0 : rungs.back().volume_mm3, q);
      if (end == RungEnd::kStopped) {  // what has grown so far is a candidate, of no score
        rungs.emplace_back().volume_mm3 = surface_->geometry().enclosed();
        found.push_back({surface_->triangles(), 0, rungs.back().volume_mm3, terms(half_width),
                         stages_.back().name});
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
      RungFeatures rung = measure_rung(model_, surface_->geometry(), seed_.noise);
      if (!rungs.empty()) {
        rung.growth_in = std::max(0.0, std::log(rung.volume_mm3 / rungs.back().volume_mm3));
        rungs.back().growth_out = std::min(kLargestGrowth, rung.growth_in);
      }
      rungs.push_back(rung);
      found.push_back(
          {surface_->triangles(), 0, rung.volume_mm3, terms(half_width), stages_.back().name});
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].score = is_judged(rungs[i], kLeastVolume) ? rungs[i].score() : 0;
      log(LogLevel::kDebug,
          fmt::format("rung {:2} beta {:.2f} a {:8.2f} V {:9.3f} ml  O {:.2f} e {:.2f} Q {:.2f} b "
                      "{:.2f} g {:.2f}  score {:.3f}",
                      i, beta_, found[i].energies[0].parameters["half-width"],
                      rungs[i].volume_mm3 / 1000, rungs[i].separation, rungs[i].edge_share,
                      rungs[i].sphericity, rungs[i].growth_in, rungs[i].growth_out,
                      found[i].score));
      candidates.push_back(std::move(found[i]));
    }
  }

 private:
  enum class RungEnd { kRest, kLeaked, kVanished, kRough, kStopped };

  /// Larger than this many voxels?
  bool is_judged(const RungFeatures& rung, double n_voxels) const {
    return rung.volume_mm3 > n_voxels * std::pow(model_.volume().voxel_size(), 3);
  }

  std::vector<EnergyTerm> terms(double half_width) const {
    return {{"window", 1, {{"mean", seed_.mean}, {"half-width", half_width}}}, {"area", beta_, {}}};
  }

  void restart() {
    mesh::MovingSurfaceOptions surface = options_.surface;
    surface.box = volume_box(model_.volume());
    surface.adaptivity.integrands = model_.integrands(terms(seed_.deviation));
    surface_ = std::make_unique<mesh::MovingSurface>(start_, surface);
  }

  /// Large objects get longer edges, up to twice the first: their necks are wider too.
  void adapt_edge_length(double volume_mm3) {
    const double radius = std::cbrt(volume_mm3 * 3 / (4 * std::numbers::pi));
    surface_->set_edge_length(std::clamp(radius / 20, options_.surface.edge_length_mm,
                                         2 * options_.surface.edge_length_mm));
  }

  RungEnd grow(double half_width, double volume_before, int q) {
    const auto energy = model_.energy(terms(half_width));
    surface_->set_integrands(model_.integrands(terms(half_width)));
    const std::string stage = fmt::format("ladder r={:.3g} rung {}", 2 * beta_, q - 1);
    const double start_volume = fem::Geometry<3>(start_.points, start_.elements).enclosed();
    // A tiny first rung may fill a whole plateau at once.
    const bool may_leak = volume_before > kLeakFrom * std::pow(model_.volume().voxel_size(), 3);
    RungEnd end = RungEnd::kRest;
    const auto start = std::chrono::steady_clock::now();
    const auto on_step = [&](const flow::StepRecord& record) {
      if (progress_ && !progress_(stage, record, [&] { return surface_->triangles(); })) {
        end = RungEnd::kStopped;
        return false;
      }
      if (may_leak && record.enclosed > std::exp(kExplosion) * volume_before) {
        end = RungEnd::kLeaked;
        return false;
      }
      adapt_edge_length(record.enclosed);
      const bool meets_itself =
          record.held_share + surface_->self_contact_share() > kLargestContact;
      if (meets_itself ||
          (record.k % 10 == 0 && sphericity(surface_->geometry()) < kLeastSphericity)) {
        end = RungEnd::kRough;
        return false;
      }
      return true;
    };
    StageReport report;
    report.name = stage;
    report.edge_length_mm = options_.surface.edge_length_mm;
    report.flow = flow::evolve<3>(*surface_, *energy, options_.flow, on_step);
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (report.flow.termination == flow::Termination::kObstacle)
      end = surface_->border_share() > 0.1 ? RungEnd::kLeaked : RungEnd::kVanished;
    if (end == RungEnd::kRest && surface_->geometry().enclosed() < 0.5 * start_volume)
      end = RungEnd::kVanished;
    stages_.push_back(std::move(report));
    return end;
  }

  ImageModel& model_;
  const SeedModel& seed_;
  const LadderOptions& options_;
  std::vector<StageReport>& stages_;
  const Progress& progress_;
  double beta_;
  const Triangles& start_;
  std::unique_ptr<mesh::MovingSurface> surface_;
};

}  // namespace

std::vector<Candidate> climb(ImageModel& model, const SeedModel& seed, const Start& starts,
                             const LadderOptions& options, std::vector<StageReport>& stages,
                             const Progress& progress) {
  const int n = static_cast<int>(options.neck_radii.size());
  std::vector<std::vector<Candidate>> found(n);
  std::vector<std::vector<StageReport>> reports(n);
  std::mutex mutex;
  const Progress one_at_a_time = [&](const auto& stage, const auto& record, const auto& surface) {
    const std::lock_guard lock(mutex);
    return !progress || progress(stage, record, surface);
  };
  tbb::parallel_for(0, n, [&](int i) {
    const Triangles start = starts(options.neck_radii[i]);
    Climb(model, seed, options.neck_radii[i], start, options, reports[i], one_at_a_time)
        .run(found[i]);
  });
  std::vector<Candidate> candidates;
  for (int i = 0; i < n; ++i) {
    std::move(found[i].begin(), found[i].end(), std::back_inserter(candidates));
    std::move(reports[i].begin(), reports[i].end(), std::back_inserter(stages));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  return candidates;
}

}  // namespace surf::segment
