#include "libsurf/segment/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/sheet_guard.h"
#include "libsurf/segment/edge_offset.h"
#include "libsurf/segment/ladder.h"
#include "libsurf/segment/model.h"
#include "libsurf/segment/nucleation.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {
namespace {

// Of a step, by the deviation of the blur: an edge is about three times as wide.
constexpr double kStepPerBlur = 1.2;
constexpr double kCoarseTolerance = 30;  // of the flow on coarser levels, times that of the last
constexpr int kMostNucleations = 3;
constexpr int kSettleSteps = 8;
constexpr double kSettleStep = 0.25;  // voxels, largest move in a step

void check_seeds(const volume::Volume& volume, const std::vector<Eigen::Vector3d>& seeds) {
  for (const Eigen::Vector3d& seed : seeds) {
    const Eigen::Vector3d index = volume.world_to_index() * seed;
    for (int axis = 0; axis < 3; ++axis)
      if (!(index[axis] >= 0 && index[axis] <= volume.size()[axis] - 1))
        throw UsageError(fmt::format(
            "--seed: ({:g}, {:g}, {:g}) RAS mm is voxel ({:.1f}, {:.1f}, {:.1f}), outside the "
            "volume of {} x {} x {} voxels; is it in another space (--space)?",
            seed[0], seed[1], seed[2], index[0], index[1], index[2], volume.size()[0],
            volume.size()[1], volume.size()[2]));
  }
}

bool is_too_close(const std::vector<Eigen::Vector3d>& seeds, const Eigen::Vector3d& seed,
                  double distance) {
  return std::any_of(seeds.begin(), seeds.end(), [&](const Eigen::Vector3d& other) {
    return (other - seed).norm() < distance;
  });
}

/// Seed balls as one surface of several components; where they may not merge, a ball that would
/// touch an earlier one is left out.
Triangles seed_balls(const std::vector<Eigen::Vector3d>& seeds, double radius, double edge_length,
                     mesh::Topology topology, std::vector<std::string>& notes) {
  const double least = topology == mesh::Topology::kFixed ? 2 * radius + edge_length
                                                          : edge_length / 4;  // the same place
  std::vector<Triangles> balls;
  std::vector<Eigen::Vector3d> used;
  for (const Eigen::Vector3d& seed : seeds) {
    if (is_too_close(used, seed, least)) {
      notes.push_back(fmt::format(
          "the ball round seed ({:g}, {:g}, {:g}) would touch another one and is left out", seed[0],
          seed[1], seed[2]));
      continue;
    }
    used.push_back(seed);
    balls.push_back(mesh::ball(seed, radius, edge_length));
  }
  return mesh::joined(balls);
}

mesh::SolidFilter solid_filter(const SegmentOptions& options) {
  const std::vector<Eigen::Vector3d>& seeds = options.seeds_ras_mm;
  mesh::SolidFilter filter = options.solids;
  filter.seeds_ras_mm.resize(Eigen::Index(seeds.size()), 3);
  for (std::size_t n = 0; n < seeds.size(); ++n) filter.seeds_ras_mm.row(n) = seeds[n];
  return filter;
}

/// One note for each reason: how many, how large, where the largest is.
void add_notes(const std::vector<mesh::Removal>& removed, std::vector<std::string>& notes) {
  struct Group {
    int n = 0;
    double total = 0;
    const mesh::Removal* largest = nullptr;
  };
  std::map<mesh::Removal::Reason, Group> groups;
  for (const mesh::Removal& removal : removed) {
    Group& group = groups[removal.reason];
    ++group.n;
    group.total += std::abs(removal.volume_mm3);
    if (!group.largest || std::abs(removal.volume_mm3) > std::abs(group.largest->volume_mm3))
      group.largest = &removal;
  }
  for (const auto& [reason, group] : groups) {
    const Eigen::Vector3d& at = group.largest->center_ras_mm;
    const std::string largest =
        fmt::format("{:.4g} mm^3 at ({:.4g}, {:.4g}, {:.4g}) RAS mm",
                    std::abs(group.largest->volume_mm3), at[0], at[1], at[2]);
    const std::string what =
        fmt::format("removed: {} {}", group.n, mesh::to_string(reason, group.n));
    notes.push_back(group.n == 1 ? fmt::format("{} of {}", what, largest)
                                 : fmt::format("{}, {:.4g} mm^3 in all, the largest of {}", what,
                                               group.total, largest));
  }
}

/// One run: options made complete, then the stages.
class Run {
 public:
  Run(const volume::Volume& volume, const SegmentOptions& options, const Progress& progress)
      : options_(options),
        progress_([this, progress](const auto& stage, const auto& record, const auto& surface) {
          is_stopped_ = progress && !progress(stage, record, surface);
          return !is_stopped_;
        }),
        model_(volume, smoothing(volume, options), options.derivative_filter) {
    result_.sigma_mm = smoothing(volume, options).sigma_mm;
    result_.edge_length_mm = options.edge_length_mm.value_or(1.5 * volume.voxel_size());
    if (!options.seeds_ras_mm.empty())
      seed_model_ =
          estimate_seed_model(*model_.intensity(), options.seeds_ras_mm, volume.voxel_size());
    const auto [lowest, highest] = volume.range();
    seed_model_.deviation = std::max(seed_model_.deviation, (double(highest) - lowest) / 256);
    result_.seed_radius_mm = options.seed_radius_mm.value_or(
        std::clamp(0.7 * seed_model_.radius_mm, 2 * volume.voxel_size(), 8 * volume.voxel_size()));
    start_ = options.initial_surface
                 ? *options.initial_surface
                 : seed_balls(options.seeds_ras_mm, result_.seed_radius_mm,
                              std::min(result_.edge_length_mm, result_.seed_radius_mm / 2),
                              options.topology, result_.notes);
  }

  SegmentResult run() {
    const bool go_on = options_.energies.empty() ? run_ladder() : run_energies();
    const Triangles unsettled = result_.surface;
    if (go_on && options_.settle) run_settle();
    if (!is_embedded(result_.surface)) choose_embedded(unsettled);
    filter_solids();
    return std::move(result_);
  }

 private:
  static bool is_embedded(const Triangles& surface) {
    return mesh::self_intersections(surface).empty();
  }

  /// The sheet guard does not see folds smaller than its distance. A surface that intersects
  /// itself gives way to what it was before it settled, or to the next candidate.
  void choose_embedded(const Triangles& unsettled) {
    if (is_embedded(unsettled)) {
      result_.surface = unsettled;
      result_.notes.push_back("settling made the surface intersect itself and is taken back");
      return;
    }
    for (std::size_t i = 1; i < result_.candidates.size(); ++i) {
      if (!is_embedded(result_.candidates[i].surface)) continue;
      std::rotate(result_.candidates.begin(), result_.candidates.begin() + i,
                  result_.candidates.begin() + i + 1);
      result_.surface = result_.candidates.front().surface;
      result_.energies = result_.candidates.front().energies;
      result_.notes.push_back(
          fmt::format("the {} best candidates intersect themselves and are passed over", i));
      return;
    }
  }

  /// Phantoms go, and what the options rule out. A surface of nothing but phantoms is inverted
  /// as a whole, which the verification has words for.
  void filter_solids() {
    mesh::FilteredSurface filtered = mesh::filtered(result_.surface, solid_filter(options_));
    const bool are_phantoms = std::all_of(
        filtered.removed.begin(), filtered.removed.end(),
        [](const auto& removal) { return removal.reason == mesh::Removal::Reason::kPhantom; });
    if (filtered.removed.empty() || (are_phantoms && filtered.surface.elements.rows() == 0)) return;
    result_.surface = std::move(filtered.surface);
    result_.removed = std::move(filtered.removed);
    add_notes(result_.removed, result_.notes);
  }

  static volume::SmoothingOptions smoothing(const volume::Volume& volume,
                                            const SegmentOptions& options) {
    volume::SmoothingOptions out;
    out.sigma_mm = options.sigma_mm.value_or(0.7 * volume.voxel_size());
    out.selective_sigma_mm = options.selective_sigma_mm;
    out.selective_threshold = options.selective_threshold;
    return out;
  }

  mesh::MovingSurfaceOptions surface_options(double edge_length) const {
    mesh::MovingSurfaceOptions out;
    out.edge_length_mm = edge_length;
    out.coarseness = options_.coarseness;
    out.adaptivity.geometry_tolerance_mm =
        options_.geometry_tolerance_mm.value_or(model_.volume().voxel_size());
    out.adaptivity.integral_tolerance = options_.integral_tolerance;
    out.topology = options_.topology;
    out.topology_resolution_mm = options_.topology_resolution_mm.value_or(0);
    if (options_.sheet_distance_mm) out.sheet_distance = *options_.sheet_distance_mm / edge_length;
    out.max_displacement_mm = kStepPerBlur * blur(result_.sigma_mm);
    out.box = volume_box(model_.volume());
    return out;
  }

  /// Standard deviation of the fields' blur [mm]: the Gaussian's and the spline's.
  double blur(double sigma_mm) const {
    const double voxel = model_.volume().voxel_size();
    return std::sqrt(sigma_mm * sigma_mm + voxel * voxel / 3);
  }

  /// False if the caller asked to stop.
  bool run_ladder() {
    LadderOptions ladder;
    ladder.surface = surface_options(result_.edge_length_mm);
    ladder.surface.edge_length_mm =
        std::max(result_.edge_length_mm, 2 * model_.volume().voxel_size());
    ladder.surface.max_displacement_mm = 0.6 * ladder.surface.edge_length_mm;
    // A leak is known by the front's contact with itself, so it is held there; but seeds may merge.
    if (options_.topology == mesh::Topology::kFree)
      ladder.surface.topology =
          options_.seeds_ras_mm.size() > 1 ? mesh::Topology::kGenus0 : mesh::Topology::kFixed;
    ladder.flow = options_.flow;
    ladder.flow.energy_tol = std::max(ladder.flow.energy_tol, 3e-3);
    ladder.flow.energy_share_on_the_way = 1;  // a leak is on its way too
    const double voxel = model_.volume().voxel_size();
    const auto starts = [&](double neck_radius) {
      const double radius = std::max(result_.seed_radius_mm, 1.4 * neck_radius * voxel);
      if (options_.initial_surface || radius == result_.seed_radius_mm) return start_;
      std::vector<std::string> notes;
      return seed_balls(options_.seeds_ras_mm, radius,
                        std::min(ladder.surface.edge_length_mm, radius / 2), options_.topology,
                        notes);
    };
    result_.candidates = climb(model_, seed_model_, starts, ladder, result_.stages, progress_);
    if (result_.candidates.empty()) {
      result_.surface = start_;
      result_.notes.push_back(is_stopped_
                                  ? "interrupted before a first surface was found: the initial "
                                    "surface is kept"
                                  : "the seed did not grow: it may lie on an edge");
      return false;
    }
    result_.surface = result_.candidates.front().surface;
    result_.energies = result_.candidates.front().energies;
    return !is_stopped_;
  }

  bool run_energies() {
    result_.energies = options_.energies;
    for (EnergyTerm& term : result_.energies) complete(term);
    Triangles start = start_;
    for (int level = options_.n_levels - 1; level > 0; --level) {
      if (run_level(level, start)) {
        start = result_.surface;
      } else if (is_stopped_) {
        return false;
      } else {  // what is too small for the level's blur is found on the next one
        result_.notes.push_back(fmt::format("level {}: {}; the next one starts where it did", level,
                                            result_.stages.back().flow.message));
      }
    }
    bool go_on = evolve("evolve", model_, result_.energies, start, options_.flow,
                        surface_options(result_.edge_length_mm));
    for (int round = 1; go_on && options_.open_cavities && round <= kMostNucleations; ++round) {
      Triangles opened = result_.surface;
      const auto energy = model_.energy(result_.energies);
      energy->reset({opened.points, opened.elements});
      const std::vector<Hole> holes = find_holes(opened, *energy, model_.volume());
      if (open_holes(opened, holes, result_.edge_length_mm, *energy) == 0) break;
      go_on = evolve(fmt::format("cavities {}", round), model_, result_.energies, opened,
                     options_.flow, surface_options(result_.edge_length_mm));
    }
    return go_on;
  }

  /// Lengths are 2^level times those of the result, and the tolerances of the flow kCoarseTolerance
  /// times: far from the optimum neither pays.
  bool run_level(int level, const Triangles& start) {
    const double scale = std::pow(2.0, level);
    volume::SmoothingOptions smoothing = Run::smoothing(model_.volume(), options_);
    smoothing.sigma_mm *= scale;
    ImageModel model(model_.volume(), smoothing, options_.derivative_filter);
    mesh::MovingSurfaceOptions surface = surface_options(scale * result_.edge_length_mm);
    surface.adaptivity.geometry_tolerance_mm *= scale;
    surface.max_displacement_mm = kStepPerBlur * blur(smoothing.sigma_mm);
    std::vector<EnergyTerm> terms = result_.energies;
    for (EnergyTerm& term : terms)  // the gradient at a step falls as the blur widens
      if (term.name == "minimal-surface")
        term.parameters["lambda"] *= blur(result_.sigma_mm) / blur(smoothing.sigma_mm);
    flow::FlowOptions flow = options_.flow;
    flow.rel_tol = std::min(0.5, kCoarseTolerance * flow.rel_tol);
    flow.energy_tol = std::min(0.5, kCoarseTolerance * flow.energy_tol);
    return evolve(fmt::format("level {}", level), model, terms, start, flow, surface);
  }

  /// Fills in what is not given.
  void complete(EnergyTerm& term) {
    auto& p = term.parameters;
    if (term.name == "minimal-surface") {
      p.try_emplace("gamma0", 1);
      if (!p.contains("gamma")) p["gamma"] = options_.initial_surface ? 0 : balloon(p["gamma0"]);
      if (!p.contains("lambda"))
        p["lambda"] =
            estimate_edge_strength(*model_.intensity(), seeds_or_centre(), model_.volume());
    } else if (term.name == "window") {
      p.try_emplace("mean", seed_model_.mean);
      p.try_emplace("half-width", 4 * seed_model_.deviation);
    }
  }

  /// gamma that makes the seed balls grow: four times what keeps one in balance (8 gamma_0 / r),
  /// but at most 0.5 gamma_0 / voxel unless that is too little to grow: an edge a few voxels wide
  /// resists about d_nu H / H = 0.6 / voxel, and a stronger force leaks through.
  double balloon(double gamma_0) const {
    const double balance = 2 * gamma_0 / result_.seed_radius_mm;
    const double barrier = 0.5 * gamma_0 / model_.volume().voxel_size();
    return -std::max(1.2 * balance, std::min(4 * balance, barrier));
  }

  std::vector<Eigen::Vector3d> seeds_or_centre() const {
    if (!options_.seeds_ras_mm.empty()) return options_.seeds_ras_mm;
    return {start_.points.colwise().mean().transpose()};
  }

  bool evolve(const std::string& stage, ImageModel& model, const std::vector<EnergyTerm>& terms,
              const Triangles& start, const flow::FlowOptions& flow,
              mesh::MovingSurfaceOptions surface_options) {
    const auto begin = std::chrono::steady_clock::now();
    surface_options.adaptivity.integrands = model.integrands(terms);
    mesh::MovingSurface surface(start, surface_options);
    const auto energy = model.energy(terms);
    bool go_on = true;
    StageReport report;
    report.name = stage;
    report.edge_length_mm = surface_options.edge_length_mm;
    report.flow = flow::evolve<3>(surface, *energy, flow, [&](const flow::StepRecord& record) {
      go_on = !progress_ || progress_(stage, record, [&] { return surface.triangles(); });
      return go_on;
    });
    report.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    result_.surface = surface.triangles();
    result_.border_share = surface.border_share();
    if (surface.is_limited())
      result_.notes.push_back(fmt::format(
          "{}: the surface is coarser than asked for: at {} triangles nothing is refined "
          "any more",
          stage, surface_options.adaptivity.max_elements));
    go_on &= report.flow.termination != flow::Termination::kObstacle;
    result_.stages.push_back(std::move(report));
    return go_on;
  }

  /// Half the median |grad I| on the surface: edges found so far are strong, noise is not.
  double edge_strength_on(const Triangles& surface) const {
    Samples<3> samples;
    model_.intensity()->sample(surface.points, Derivatives::kFirst, samples);
    std::vector<double> gradients;
    for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
      gradients.push_back(samples.gradient.row(i).norm());
    return 0.5 * median(std::move(gradients));
  }

  /// Minimises int H dS from the surface found: at most kSettleSteps small steps, so that what
  /// lies on a weak edge stays about where it is; then takes off the bias of the curvature.
  bool run_settle() {
    double lambda = edge_strength_on(result_.surface);
    for (const EnergyTerm& term : result_.energies)  // the field of the run is there already
      if (term.name == "minimal-surface") lambda = term.parameters.at("lambda");
    if (!(lambda > 0)) return true;
    flow::FlowOptions flow = options_.flow;
    flow.max_steps = std::min(flow.max_steps, kSettleSteps);
    const double voxel = model_.volume().voxel_size();
    mesh::MovingSurfaceOptions surface = surface_options(result_.edge_length_mm);
    surface.max_displacement_mm = kSettleStep * voxel;
    const std::vector<EnergyTerm> terms = {
        {"minimal-surface", 1, {{"gamma0", 1}, {"gamma", 0}, {"lambda", lambda}}}};
    const Triangles start = result_.surface;
    const bool go_on = evolve("settle", model_, terms, start, flow, surface);
    if (!go_on) return false;
    Triangles& settled = result_.surface;
    Points<3> to = moved_to_edge(settled, *model_.edge_indicator(lambda), kSettleStep * voxel);
    mesh::hold_intersecting(settled.points, to, settled.elements);
    settled.points = to;
    return true;
  }

  const SegmentOptions& options_;
  bool is_stopped_ = false;  // the caller asked to
  Progress progress_;
  ImageModel model_;
  SeedModel seed_model_;
  Triangles start_;
  SegmentResult result_;
};

}  // namespace

std::string SegmentOptions::error() const {
  if (seeds_ras_mm.empty() && !initial_surface) return "no seed and no initial surface";
  if (seed_radius_mm && !(*seed_radius_mm > 0))
    return fmt::format("SegmentOptions::seed_radius_mm = {} violates > 0", *seed_radius_mm);
  if (sigma_mm && !(*sigma_mm >= 0))
    return fmt::format("SegmentOptions::sigma_mm = {} violates >= 0", *sigma_mm);
  if (edge_length_mm && !(*edge_length_mm > 0))
    return fmt::format("SegmentOptions::edge_length_mm = {} violates > 0", *edge_length_mm);
  if (energies.empty() && initial_surface && seeds_ras_mm.empty())
    return "an initial surface without seeds needs an explicit energy";
  if (n_levels < 1 || n_levels > 6)
    return fmt::format("SegmentOptions::n_levels = {} violates 1 to 6", n_levels);
  if (!(coarseness >= 1))
    return fmt::format("SegmentOptions::coarseness = {} violates >= 1", coarseness);
  if (geometry_tolerance_mm && !(*geometry_tolerance_mm > 0))
    return fmt::format("SegmentOptions::geometry_tolerance_mm = {} violates > 0",
                       *geometry_tolerance_mm);
  if (!(integral_tolerance >= 0))
    return fmt::format("SegmentOptions::integral_tolerance = {} violates >= 0", integral_tolerance);
  if (std::string error = solid_filter(*this).error(); !error.empty()) return error;
  return flow.error();
}

const StageReport& SegmentResult::main_stage() const {
  const auto is_main = [&](const StageReport& stage) {
    return candidates.empty() ? stage.name != "settle" : stage.name == candidates.front().stage;
  };
  const auto at = std::find_if(stages.rbegin(), stages.rend(), is_main);
  return at == stages.rend() ? stages.back() : *at;
}

SegmentResult segment(const volume::Volume& volume, const SegmentOptions& options,
                      const Progress& progress) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  check_terms(options.energies);
  check_seeds(volume, options.seeds_ras_mm);
  return Run(volume, options, progress).run();
}

}  // namespace surf::segment
