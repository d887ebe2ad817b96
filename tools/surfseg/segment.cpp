// surfseg segment: a volume and seeds in, a verified surface out.
#include "libsurf/segment/segment.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/arguments.h"
#include "tools/common/config.h"
#include "tools/common/energy_term.h"
#include "tools/common/outputs.h"
#include "tools/common/progress.h"
#include "tools/common/report.h"
#include "tools/common/signals.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/initial_surface.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

/// The options as they were typed; Length and the like are parsed when the volume is known.
struct Arguments {
  std::string volume, output;
  int frame_index = 0;
  std::vector<std::string> seeds;
  std::string space = "ras";
  std::string radius, sigma, selective_sigma, edge_length, geometry_tolerance, topology_resolution,
      sheet_distance;
  std::string topology = "free";
  InitialArguments initial;
  double selective_threshold = 0;
  std::string derivatives = "bspline";
  std::vector<std::string> energies;
  std::string lambda = "auto";
  double gamma = 0, gamma0 = 1;
  std::string flow = "h1", scheme = "auto", step_rule = "line-search";
  int max_iterations = 500;
  double coarseness = 4, integral_tolerance = 0.016;
  int levels = 1;
  double tolerance = 1e-4;
  bool no_settle = false, open_cavities = false;
  double min_component_mm3 = 0;
  bool fill_cavities = false;
  std::string keep = "all";
  int threads = 0;
  std::string output_space = "lps", mask, json, config;
  int candidates = 0;
  bool quiet = false, verbose = false;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

ordered_json to_json(const surf::Vector<3>& point) { return {point[0], point[1], point[2]}; }

ordered_json to_json(const surf::mesh::Shell& shell) {
  return {{"volume_mm3", std::abs(shell.volume_mm3)},
          {"area_mm2", shell.area_mm2},
          {"genus", shell.genus},
          {"center_ras_mm", to_json(shell.center_ras_mm)}};
}

/// One entry for each outer shell, its cavities in it; volumes are those that the shells enclose.
ordered_json shells_of(const surf::Triangles& surface) {
  const surf::mesh::ShellHierarchy hierarchy = surf::mesh::shell_hierarchy(surface);
  ordered_json out = ordered_json::array();
  for (const surf::mesh::Solid& solid : surf::mesh::solids(hierarchy)) {
    ordered_json entry = to_json(hierarchy.shells[solid.outer]);
    entry["cavities"] = ordered_json::array();
    for (const int cavity : solid.cavities)
      entry["cavities"].push_back(to_json(hierarchy.shells[cavity]));
    out.push_back(entry);
  }
  return out;
}

/// Time and peak memory of the program's stages, for the summary.
class StageClock {
 public:
  void begin(const std::string& name) {
    end();
    name_ = name;
    start_ = std::chrono::steady_clock::now();
  }
  void end() {
    if (!name_.empty())
      stages_[name_] = {{"time_s", std::round(1000 * seconds_since(start_)) / 1000},
                        {"peak_memory_mb", std::round(peak_memory_mb())}};
    name_.clear();
  }
  const ordered_json& stages() const { return stages_; }

 private:
  std::string name_;
  std::chrono::steady_clock::time_point start_;
  ordered_json stages_ = ordered_json::object();
};

/// One run of the command.
class SegmentCommand {
 public:
  SegmentCommand(const CLI::App& command, const Arguments& arguments)
      : command_(command),
        arguments_(arguments),
        progress_(arguments.quiet     ? Verbosity::kQuiet
                  : arguments.verbose ? Verbosity::kVerbose
                                      : Verbosity::kNormal) {}

  ExitCode run() {
    check();
    std::unique_ptr<surf::ThreadLimit> limit;
    if (arguments_.threads > 0) limit = std::make_unique<surf::ThreadLimit>(arguments_.threads);
    clock_.begin("read");
    surf::volume::ReadOptions read_options;
    read_options.frame_index = arguments_.frame_index;
    const surf::volume::Volume volume = surf::volume::read_volume(arguments_.volume, read_options);
    for (const std::string& note : volume.source().notes) progress_.note("note: " + note);
    const surf::segment::SegmentOptions options = segment_options(volume);
    catch_signals();
    clock_.begin("segment");
    const auto result = surf::segment::segment(
        volume, options,
        [&](const std::string& stage, const surf::flow::StepRecord& record, const auto&) {
          report_step(stage, record);
          return signal_exit_code() == kDone;
        });
    clock_.begin("verify");
    const surf::Triangles surface =
        surf::io::rounded_to_file(result.shape, surf::extension(arguments_.output));
    const surf::mesh::Verification verification = surf::mesh::verify(surface);
    clock_.begin("write");
    ExitCode exit_code = exit_code_of(result);
    if (verification.passed())
      write(volume, result, surface);
    else
      exit_code = kInvalidResult;
    clock_.end();
    const ordered_json summary = summarise(result, surface, verification, exit_code);
    if (!arguments_.json.empty()) write_json(arguments_.json, summary);
    conclude(result, summary, verification);
    if (exit_code == kInvalidResult)
      throw surf::InvalidMesh(
          fmt::format("{}: not written: {}", arguments_.output,
                      surface.elements.rows() == 0 && !result.removed.empty()
                          ? "--min-component and --keep leave no component; " + result.notes.back()
                          : verification.message()));
    return exit_code;
  }

 private:
  /// What can be found wrong before the work is done.
  void check() const {
    check_values();
    check_names();
    surfseg::check_outputs(
        {{"-o", arguments_.output}, {"--mask", arguments_.mask}, {"--json", arguments_.json}},
        arguments_.volume);
  }

  void check_names() const {
    if (arguments_.output.empty())
      throw surf::UsageError("-o: an output file is missing, such as -o liver.stl");
    if (!surf::io::is_writable_surface(arguments_.output))
      throw surf::UsageError(fmt::format(
          "-o: {}: expected a name that ends in .stl, .obj, .ply or .vtp", arguments_.output));
    if (!arguments_.mask.empty() && !surf::volume::is_writable_volume(arguments_.mask))
      throw surf::UsageError(
          fmt::format("--mask: {}: expected a name that ends in .nii.gz, .nii, .mha or .nrrd",
                      arguments_.mask));
  }

  void check_values() const {
    check_range("--threads", arguments_.threads, 0, "0 (all) or more");
    check_range("--max-iterations", arguments_.max_iterations, 0, "0 or more");
    check_range("--candidates", arguments_.candidates, 0, "0 or more");
    check_range("--frame-index", arguments_.frame_index, 0, "0 or more");
    if (!(arguments_.tolerance >= 0 && arguments_.tolerance < 1))
      throw surf::UsageError(
          fmt::format("--tolerance: expected a number from 0 to below 1, such as 1e-4; got {}",
                      arguments_.tolerance));
    if (arguments_.levels < 1 || arguments_.levels > 6)
      throw surf::UsageError(
          fmt::format("--levels: expected a number from 1 to 6; got {}", arguments_.levels));
    if (!(arguments_.coarseness >= 1 && arguments_.coarseness <= 1000))
      throw surf::UsageError(fmt::format("--coarseness: expected a number from 1 to 1000; got {}",
                                         arguments_.coarseness));
    if (!(arguments_.integral_tolerance >= 0))
      throw surf::UsageError(fmt::format("--integral-tolerance: expected 0 or more; got {}",
                                         arguments_.integral_tolerance));
    if (!(arguments_.min_component_mm3 >= 0 && std::isfinite(arguments_.min_component_mm3)))
      throw surf::UsageError(
          fmt::format("--min-component: expected a volume in mm^3, 0 or more, such as 50; got {}",
                      arguments_.min_component_mm3));
    if (arguments_.keep == "seeded" && arguments_.seeds.empty() && !arguments_.initial.is_body())
      throw surf::UsageError("--keep seeded: a --seed in each component to keep is needed");
    if (!(arguments_.selective_threshold >= 0))
      throw surf::UsageError(fmt::format("--selective-threshold: expected 0 or more; got {}",
                                         arguments_.selective_threshold));
    for (const std::string& seed : arguments_.seeds) parse_point("--seed", seed);
    for (const auto& [option, text] : {std::pair{"--sigma", arguments_.sigma},
                                       {"--selective-sigma", arguments_.selective_sigma}})
      if (!text.empty()) parse_length(option, text);
    for (const auto& [option, text] : {std::pair{"--radius", arguments_.radius},
                                       {"--edge-length", arguments_.edge_length},
                                       {"--geometry-tolerance", arguments_.geometry_tolerance},
                                       {"--topology-resolution", arguments_.topology_resolution},
                                       {"--sheet-distance", arguments_.sheet_distance}})
      if (!text.empty()) parse_positive_length(option, text);
    arguments_.initial.check();
    surf::segment::check_terms(energies());
    if (arguments_.seeds.empty() && !arguments_.initial.any())
      throw surf::UsageError(
          "--seed: at least one point inside the object is needed, such as --seed 12.5,-30,44, or "
          "an --initial surface");
    if (arguments_.seeds.empty() && !arguments_.initial.is_body() && energies().empty())
      throw surf::UsageError(
          "--initial: without a --seed inside the object, --energy is needed, such as --energy "
          "minimal-surface");
  }

  static void check_range(const char* option, int value, int lowest, const char* expected) {
    if (value < lowest)
      throw surf::UsageError(fmt::format("{}: expected {}; got {}", option, expected, value));
  }

  surf::segment::SegmentOptions segment_options(const surf::volume::Volume& volume) const {
    const Space space = parse_space("--space", arguments_.space);
    const auto length = [&](const char* option, const std::string& text) -> std::optional<double> {
      if (text.empty()) return std::nullopt;
      return parse_length(option, text).mm(std::pow(volume.voxel_size(), 3));
    };
    surf::segment::SegmentOptions out;
    for (const std::string& seed : arguments_.seeds)
      out.seeds_mm.push_back(
          to_ras_mm(parse_point("--seed", seed), space, volume.index_to_world()));
    out.seed_radius_mm = length("--radius", arguments_.radius);
    out.sigma_mm = length("--sigma", arguments_.sigma);
    out.selective_sigma_mm = length("--selective-sigma", arguments_.selective_sigma).value_or(0);
    out.selective_threshold = arguments_.selective_threshold;
    out.edge_length_mm = length("--edge-length", arguments_.edge_length);
    out.coarseness = arguments_.coarseness;
    out.n_levels = arguments_.levels;
    out.geometry_tolerance_mm = length("--geometry-tolerance", arguments_.geometry_tolerance);
    out.integral_tolerance = arguments_.integral_tolerance;
    out.topology = arguments_.topology == "fixed"    ? surf::mesh::Topology::kFixed
                   : arguments_.topology == "genus0" ? surf::mesh::Topology::kGenus0
                                                     : surf::mesh::Topology::kFree;
    out.sheet_distance_mm = length("--sheet-distance", arguments_.sheet_distance);
    out.topology_resolution_mm = length("--topology-resolution", arguments_.topology_resolution);
    if (arguments_.derivatives == "scharr")
      out.derivative_filter = surf::volume::DerivativeFilter::kScharr;
    if (arguments_.initial.any()) set_initial_surface(out, space, volume);
    out.energies = energies();
    out.settle = !arguments_.no_settle;
    out.open_cavities = arguments_.open_cavities;
    out.solids.min_volume_mm3 = arguments_.min_component_mm3;
    out.solids.fill_cavities = arguments_.fill_cavities;
    if (arguments_.keep == "largest") out.solids.keep = surf::mesh::Keep::kLargest;
    if (arguments_.keep == "seeded") out.solids.keep = surf::mesh::Keep::kSeeded;
    out.flow.max_steps = arguments_.max_iterations;
    out.flow.rel_tol = arguments_.tolerance;
    using namespace surf::flow;
    const bool is_l2 = arguments_.flow == "l2";
    out.flow.velocity.product = is_l2 ? ScalarProduct::kL2 : ScalarProduct::kH1;
    const bool is_implicit =
        arguments_.scheme == "semi-implicit" || (arguments_.scheme == "auto" && is_l2);
    out.flow.velocity.scheme = is_implicit ? Scheme::kSemiImplicit : Scheme::kExplicit;
    if (arguments_.step_rule == "backtracking") out.flow.step.rule = StepRule::kBacktracking;
    return out;
  }

  /// The centre of a body serves as seed, to choose parameters, if there is no other.
  void set_initial_surface(surf::segment::SegmentOptions& out, Space space,
                           const surf::volume::Volume& volume) const {
    InitialSurface initial = make_initial_surface(
        arguments_.initial, space, volume, out.edge_length_mm.value_or(1.5 * volume.voxel_size()));
    out.initial = std::move(initial.surface);
    if (out.seeds_mm.empty() && initial.center_ras_mm)
      out.seeds_mm.push_back(*initial.center_ras_mm);
  }

  /// The --energy terms with the shorthands --gamma, --gamma0 and --lambda filled in.
  std::vector<surf::segment::EnergyTerm> energies() const {
    std::vector<surf::segment::EnergyTerm> terms;
    for (const std::string& text : arguments_.energies)
      if (text != "auto") terms.push_back(parse_energy_term("--energy", text));
    const bool has_gamma = command_.count("--gamma") > 0,
               has_gamma0 = command_.count("--gamma0") > 0;
    const bool has_lambda = arguments_.lambda != "auto";
    if (!has_gamma && !has_gamma0 && !has_lambda) return terms;
    if (terms.empty()) terms.push_back({"minimal-surface", 1, {}});
    bool is_used = false;
    for (auto& term : terms) {
      if (term.name != "minimal-surface") continue;
      is_used = true;
      if (has_gamma) term.parameters.try_emplace("gamma", arguments_.gamma);
      if (has_gamma0) term.parameters.try_emplace("gamma0", arguments_.gamma0);
      if (has_lambda)
        term.parameters.try_emplace("lambda", parse_number("--lambda", arguments_.lambda));
    }
    if (!is_used)
      throw surf::UsageError(
          "--gamma, --gamma0, --lambda: they belong to --energy minimal-surface, which is not "
          "used");
    return terms;
  }

  void report_step(const std::string& stage, const surf::flow::StepRecord& record) {
    progress_.step(
        fmt::format("{:<20} step {:4}  J {:<12.6g} tau {:<9.3g} triangles {:7}  volume {:<10.5g} "
                    "mm^3  {:6.1f} s{}",
                    stage, record.k, record.energy, record.tau, record.n_elements, record.enclosed,
                    seconds_since(start_), words(record.events)));
  }

  /// "  2 merging, 1 splitting"
  static std::string words(const std::vector<surf::flow::TopologyEvent>& events) {
    std::map<std::string, int> kinds;
    for (const auto& event : events) ++kinds[event.kind];
    std::string out;
    for (const auto& [kind, n] : kinds)
      out += fmt::format("{}{} {}", out.empty() ? "  " : ", ", n, kind);
    return out;
  }

  static ordered_json events_of(const surf::segment::SegmentResult& result) {
    ordered_json out = ordered_json::array();
    for (const auto& stage : result.stages)
      for (const auto& step : stage.flow.steps)
        for (const auto& event : step.events)
          out.push_back({{"stage", stage.name},
                         {"step", step.k},
                         {"kind", event.kind},
                         {"place_ras_mm", to_json(event.place)},
                         {"volume_change_mm3", event.enclosed_change}});
    return out;
  }

  ExitCode exit_code_of(const surf::segment::SegmentResult& result) const {
    if (const ExitCode code = signal_exit_code(); code != kDone) return code;
    if (result.stages.empty()) return kDone;
    return result.main_stage().flow.termination == surf::flow::Termination::kMaxSteps
               ? kStoppedAtLimit
               : kDone;
  }

  void write(const surf::volume::Volume& volume, const surf::segment::SegmentResult& result,
             const surf::Triangles& surface) const {
    using surf::io::Space;
    const surf::io::WriteOptions options{arguments_.output_space == "ras" ? Space::kRas
                                                                          : Space::kLps};
    surf::io::write_surface(arguments_.output, surface, options);
    if (!arguments_.mask.empty())
      surf::volume::write_label_map(
          arguments_.mask, volume.size(), volume.index_to_world(),
          surf::mesh::rasterize(surface, volume.size(), volume.index_to_world()));
    const std::filesystem::path path(arguments_.output);
    for (std::size_t i = 1; i < result.candidates.size() && int(i) <= arguments_.candidates; ++i)
      surf::io::write_surface((path.parent_path() / fmt::format("{}-{}{}", path.stem().string(),
                                                                i + 1, path.extension().string()))
                                  .string(),
                              result.candidates[i].shape, options);
  }

  ordered_json summarise(const surf::segment::SegmentResult& result, const surf::Triangles& surface,
                         const surf::mesh::Verification& verification, ExitCode exit_code) const {
    ordered_json out;
    out["surfseg"] = SURFSEG_VERSION;
    out["config"] = dump_config(command_, {"help", "config", "json"});
    out["exit_code"] = int(exit_code);
    int iterations = 0;
    for (const auto& stage : result.stages) iterations += int(stage.flow.steps.size());
    if (!result.stages.empty()) {
      const auto& main = result.main_stage().flow;
      out["energy"] = main.final_energy;
      out["iterations"] = iterations;
      out["stop_reason"] = surf::flow::to_string(main.termination);
      out["stop_message"] = main.message;
    }
    const surf::mesh::Quality quality = surf::mesh::quality(surface);
    out["vertices"] = surface.points.rows();
    out["triangles"] = surface.elements.rows();
    out["volume_mm3"] = surf::mesh::volume_mm3(surface);
    out["area_mm2"] = surf::mesh::area_mm2(surface);
    const surf::Vector<3> centroid = surf::mesh::centroid(surface);
    out["centroid_ras_mm"] = {centroid[0], centroid[1], centroid[2]};
    out["components"] = verification.n_components;
    out["closed"] = verification.closed;
    out["manifold"] = verification.manifold;
    out["outward"] = verification.outward;
    out["self_intersections"] = verification.n_self_intersections;
    out["degenerate_triangles"] = verification.n_degenerate;
    out["min_angle_deg"] = quality.min_angle_deg;
    out["share_above_25_deg"] = quality.share_above_25_deg;
    out["border_share"] = result.border_share;
    if (verification.passed()) out["shells"] = shells_of(surface);
    for (const auto& removal : result.removed)
      out["removed"].push_back({{"what", surf::mesh::to_string(removal.reason)},
                                {"shells", removal.n_shells},
                                {"volume_mm3", removal.volume_mm3},
                                {"center_ras_mm", to_json(removal.center_ras_mm)}});
    out["topology_events"] = events_of(result);
    out["notes"] = result.notes;
    ordered_json chosen;
    chosen["sigma_mm"] = result.sigma_mm;
    chosen["edge_length_mm"] = result.edge_length_mm;
    chosen["seed_radius_mm"] = result.seed_radius_mm;
    for (const auto& term : result.energies) chosen["energies"].push_back(to_string(term));
    out["chosen"] = chosen;
    for (const auto& candidate : result.candidates) {
      ordered_json entry{{"score", candidate.score}, {"volume_mm3", candidate.enclosed}};
      for (const auto& term : candidate.energies) entry["energies"].push_back(to_string(term));
      out["candidates"].push_back(entry);
    }
    for (const auto& stage : result.stages)
      out["evolution"].push_back({{"stage", stage.name},
                                  {"steps", stage.flow.steps.size()},
                                  {"energy_before", stage.flow.initial_energy},
                                  {"energy_after", stage.flow.final_energy},
                                  {"stop_reason", surf::flow::to_string(stage.flow.termination)},
                                  {"stop_message", stage.flow.message},
                                  {"edge_length_mm", stage.edge_length_mm},
                                  {"time_s", stage.seconds}});
    out["stages"] = clock_.stages();
    out["time_s"] = seconds_since(start_);
    out["peak_memory_mb"] = peak_memory_mb();
    return out;
  }

  void conclude(const surf::segment::SegmentResult& result, const ordered_json& summary,
                const surf::mesh::Verification& verification) {
    for (const std::string& note : result.notes) progress_.note("note: " + note);
    if (result.border_share > 0)
      progress_.note(
          fmt::format("note: the surface meets the volume's border with {:.1f} % of its vertices",
                      100 * result.border_share));
    if (!result.stages.empty())
      progress_.note(fmt::format(
          "{} after {} steps: {}", surf::flow::to_string(result.main_stage().flow.termination),
          summary["iterations"].get<int>(), result.main_stage().flow.message));
    if (verification.passed())
      progress_.note(fmt::format(
          "{}: {} triangles, {:.5g} ml, {:.5g} cm^2, closed, manifold, no self-intersections, "
          "smallest angle {:.1f} deg, {:.2f} s",
          arguments_.output, summary["triangles"].get<int>(),
          summary["volume_mm3"].get<double>() / 1000, summary["area_mm2"].get<double>() / 100,
          summary["min_angle_deg"].get<double>(), summary["time_s"].get<double>()));
  }

  const CLI::App& command_;
  const Arguments& arguments_;
  ProgressLine progress_;
  StageClock clock_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void add_options(CLI::App& command, Arguments& a) {
  command.add_option(
      "VOLUME", a.volume,
      "NIfTI, MetaImage, NRRD, VTI or OpenVDB file, a DICOM folder or one of its files");
  command.add_option("-o,--output", a.output, "Surface to write: .stl, .obj, .ply or .vtp");
  command.add_option("--frame-index", a.frame_index, "Frame of a 4-D volume, from 0")
      ->capture_default_str();

  const std::string start = "Where to start";
  command.add_option("--seed", a.seeds, "Point X,Y,Z inside the object; repeat for more")
      ->take_all()
      ->allow_extra_args(false)
      ->group(start);
  command.add_option("--space", a.space, "Space of the points: ras or lps in mm, or ijk voxels")
      ->check(CLI::IsMember({"ras", "lps", "ijk"}))
      ->capture_default_str()
      ->group(start);
  command.add_option("--radius", a.radius, "Radius of the seed balls, such as 10mm or 5vox [auto]")
      ->group(start);
  command
      .add_option("--initial", a.initial.file,
                  "Initial surface in place of seed balls: a mesh or a label map")
      ->group(start);
  command.add_option("--initial-ball", a.initial.ball, "Or a ball X,Y,Z,RADIUS: 12,-30,44,10mm")
      ->group(start);
  command
      .add_option("--initial-ellipsoid", a.initial.ellipsoid,
                  "Or an ellipsoid X,Y,Z,A,B,C along the axes of --space: 12,-30,44,10mm,8mm,15mm")
      ->group(start);
  command
      .add_option("--initial-box", a.initial.box,
                  "Or a box along the axes of --space from corner to corner: 0,-40,20,25,-10,50")
      ->group(start);
  command.add_option("--initial-label", a.initial.label, "Label to take from the label map")
      ->capture_default_str()
      ->group(start);

  const std::string image = "Image";
  command.add_option("--sigma", a.sigma, "Gaussian smoothing, such as 1mm or 0.5vox [0.7vox]")
      ->group(image);
  command
      .add_option("--selective-sigma", a.selective_sigma,
                  "Selective Gaussian blur before it: smooths where differences are small")
      ->group(image);
  command
      .add_option("--selective-threshold", a.selective_threshold,
                  "Its threshold, in the volume's intensities")
      ->group(image);
  command.add_option("--derivatives", a.derivatives, "Gradient filter: bspline or scharr")
      ->check(CLI::IsMember({"bspline", "scharr"}))
      ->capture_default_str()
      ->group(image);

  const std::string energy = "Energy";
  command
      .add_option("--energy", a.energies,
                  "Term NAME[:key=value,...] of the energy, repeatable: minimal-surface, "
                  "chan-vese, window, area; auto chooses from the seeds")
      ->take_all()
      ->allow_extra_args(false)
      ->default_str("auto")
      ->group(energy);
  command
      .add_option("--lambda", a.lambda, "Edge strength [intensity/mm] of minimal-surface, or auto")
      ->capture_default_str()
      ->group(energy);
  command.add_option("--gamma", a.gamma, "Weight of its volume term [1/mm]; < 0 grows [auto]")
      ->group(energy);
  command.add_option("--gamma0", a.gamma0, "Weight of its area term [1]")->group(energy);
  command.add_flag("--no-settle", a.no_settle, "Skip the last stage, which settles on the edges")
      ->group(energy);

  const std::string flow = "Flow";
  command
      .add_option("--levels", a.levels,
                  "Begin with coarser surfaces in an image that is smoothed more: each level "
                  "doubles sigma and edges")
      ->capture_default_str()
      ->group(flow);
  const std::string mesh = "Mesh";
  command
      .add_option("--edge-length", a.edge_length,
                  "Edges of the result where it is finest, such as 2mm [1.5vox]")
      ->group(mesh);
  command
      .add_option("--coarseness", a.coarseness,
                  "Edges may be this many times longer where the surface is flat; 1: all the same")
      ->capture_default_str()
      ->group(mesh);
  command
      .add_option("--geometry-tolerance", a.geometry_tolerance,
                  "Bound on edge length times angle to the neighbours, summed over a triangle's "
                  "sides; the finest edges may exceed it [1vox]")
      ->group(mesh);
  command
      .add_option("--integral-tolerance", a.integral_tolerance,
                  "Quadrature error of H, or of the window, per area above which triangles are "
                  "refined; 0: do not look")
      ->capture_default_str()
      ->group(mesh);
  command.add_option("--flow", a.flow, "Scalar product: h1 (weighted, inexact Newton) or l2")
      ->check(CLI::IsMember({"h1", "l2"}))
      ->capture_default_str()
      ->group(flow);
  command
      .add_option("--scheme", a.scheme,
                  "Time discretisation; auto: explicit for h1, else semi-implicit")
      ->check(CLI::IsMember({"auto", "explicit", "semi-implicit"}))
      ->capture_default_str()
      ->group(flow);
  command.add_option("--step-rule", a.step_rule, "Time step: line-search or backtracking")
      ->check(CLI::IsMember({"line-search", "backtracking"}))
      ->capture_default_str()
      ->group(flow);
  command
      .add_option("--max-iterations", a.max_iterations,
                  "Steps per stage; exit code 5 if they do not suffice")
      ->capture_default_str()
      ->group(flow);
  command
      .add_option("--tolerance", a.tolerance,
                  "Stop when the shape derivative falls to this share of its largest value")
      ->capture_default_str()
      ->group(flow);

  const std::string topology = "Topology";
  command
      .add_option("--topology", a.topology,
                  "free: sheets that meet are joined, necks are cut; fixed: they are held apart; "
                  "genus0: free, but without handles")
      ->check(CLI::IsMember({"free", "fixed", "genus0"}))
      ->capture_default_str()
      ->group(topology);
  command
      .add_option("--topology-resolution", a.topology_resolution,
                  "What is thinner is joined or cut where sheets meet, such as 1mm [0.7 of "
                  "--edge-length]")
      ->group(topology);

  command
      .add_flag(
          "--open-cavities", a.open_cavities,
          "Open cavities where chan-vese or window asks for them, though the surface came from "
          "outside")
      ->group(topology);
  command
      .add_option(
          "--sheet-distance", a.sheet_distance,
          "Distance at which sheets are held apart where they may not join, such as 1mm [0.7 "
          "of --edge-length]")
      ->group(topology);

  const std::string components = "Components of the result, in this order";
  command.add_flag("--fill-cavities", a.fill_cavities, "Fill cavities, with all that lies in them")
      ->group(components);
  command
      .add_option("--min-component", a.min_component_mm3,
                  "Drop components of less volume [mm^3], with their cavities")
      ->capture_default_str()
      ->group(components);
  command
      .add_option("--keep", a.keep,
                  "Keep all components, the largest, or the seeded: those that contain a seed")
      ->check(CLI::IsMember({"all", "largest", "seeded"}))
      ->capture_default_str()
      ->group(components);

  const std::string output = "Output and running";
  command.add_option("--output-space", a.output_space, "Frame of the file: lps (as Slicer) or ras")
      ->check(CLI::IsMember({"lps", "ras"}))
      ->capture_default_str()
      ->group(output);
  command
      .add_option("--mask", a.mask, "Label map on the volume's grid: .nii.gz, .nii, .mha, .nrrd")
      ->group(output);
  command
      .add_option("--candidates", a.candidates, "Write up to this many further candidate surfaces")
      ->capture_default_str()
      ->group(output);
  command.add_option("--json", a.json, "Summary; it can be fed back as --config")->group(output);
  command.add_option("--config", a.config, "JSON file of options; the command line wins")
      ->group(output);
  command.add_option("--threads", a.threads, "Threads [all]; the result is the same")
      ->group(output);
  command.add_flag("-q,--quiet", a.quiet, "Print errors only")->group(output);
  command.add_flag("-v,--verbose", a.verbose, "Print every step")->group(output);
}

}  // namespace

void add_segment_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("segment", "Grow a surface from seeds in a volume");
  add_options(*command, *arguments);
  command->footer(
      "Examples:\n"
      "  surfseg segment head.nii.gz --seed 3,-20,35 -o brain.stl\n"
      "  surfseg segment ct/ --seed 120,88,40 --space ijk --radius 8mm -o kidney.ply --mask "
      "kidney.nii.gz\n"
      "  surfseg segment mr.nrrd --seed -12,40,7 --energy window:mean=380,half-width=150 \\\n"
      "          --energy area:weight=2 --json summary.json -o tumour.obj\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 output, 5 stopped at the iteration limit (result\n"
      "written), 6 result fails a guarantee (not written), 130/143 interrupted (last surface "
      "written).");
  command->callback([command, arguments, &exit_code] {
    if (!arguments->config.empty()) apply_config(*command, arguments->config);
    if (arguments->volume.empty()) throw surf::UsageError("VOLUME: a volume is missing");
    exit_code = SegmentCommand(*command, *arguments).run();
  });
}

}  // namespace surfseg
