// surfseg segment: a volume and seeds in, a verified surface out.
#include "libsurf/segment/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/denoised.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/arguments.h"
#include "tools/common/config.h"
#include "tools/common/outputs.h"
#include "tools/common/progress.h"
#include "tools/common/report.h"
#include "tools/common/run_arguments.h"
#include "tools/common/run_report.h"
#include "tools/common/signals.h"
#include "tools/common/stage_clock.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/initial_surface.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;

const RunWords kWords = {"surface", "vox",   "volume", "volume",   "area",
                         "3",       "X,Y,Z", "balls",  "cavities", true};

/// The options as they were typed.
struct Arguments : RunArguments {
  std::string volume, output;
  int frame_index = 0;
  std::string space = "ras";
  InitialArguments initial;
  std::string output_space = "lps", mask, denoised;
  int candidates = 0;
};

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

/// One run of the command.
class SegmentCommand {
 public:
  SegmentCommand(const CLI::App& command, const Arguments& arguments)
      : command_(command), arguments_(arguments), progress_(arguments.verbosity()) {}

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
          progress_.step(
              step_line(stage, record, "triangles", "volume", "mm^3", clock_.total_seconds()));
          return signal_exit_code() == kDone;
        });
    clock_.begin("verify");
    const surf::Triangles surface =
        surf::io::rounded_to_file(result.shape, surf::extension(arguments_.output));
    const surf::mesh::Verification verification = surf::mesh::verify(surface);
    clock_.begin("write");
    ExitCode exit_code = exit_code_of<3>(result);
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
    surfseg::check_outputs({{"-o", arguments_.output},
                            {"--mask", arguments_.mask},
                            {"--denoised", arguments_.denoised},
                            {"--json", arguments_.json}},
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
    check_denoised();
  }

  void check_denoised() const {
    if (arguments_.denoised.empty()) return;
    if (!surf::volume::is_writable_volume(arguments_.denoised))
      throw surf::UsageError(
          fmt::format("--denoised: {}: expected a name that ends in .nii.gz, .nii, .mha or .nrrd",
                      arguments_.denoised));
    if (!surf::segment::is_piecewise_smooth<3>(arguments_.terms(command_)))
      throw surf::UsageError(
          "--denoised: only the Mumford-Shah model has such a volume; add --energy mumford-shah");
  }

  void check_values() const {
    check_run_arguments(command_, arguments_, kWords);
    check_range("--candidates", arguments_.candidates, 0, "0 or more");
    check_range("--frame-index", arguments_.frame_index, 0, "0 or more");
    if (arguments_.keep == "seeded" && arguments_.seeds.empty() && !arguments_.initial.is_body())
      throw surf::UsageError("--keep seeded: a --seed in each component to keep is needed");
    for (const std::string& seed : arguments_.seeds) parse_point("--seed", seed);
    arguments_.initial.check();
    if (arguments_.seeds.empty() && !arguments_.initial.any())
      throw surf::UsageError(
          "--seed: at least one point inside the object is needed, such as --seed 12.5,-30,44, or "
          "an --initial surface");
    if (arguments_.seeds.empty() && !arguments_.initial.is_body() &&
        arguments_.terms(command_).empty())
      throw surf::UsageError(
          "--initial: without a --seed inside the object, --energy is needed, such as --energy "
          "minimal-surface");
  }

  surf::segment::SegmentOptions segment_options(const surf::volume::Volume& volume) const {
    const Space space = parse_space("--space", arguments_.space);
    surf::segment::SegmentOptions out;
    for (const std::string& seed : arguments_.seeds)
      out.seeds_mm.push_back(
          to_ras_mm(parse_point("--seed", seed), space, volume.index_to_world()));
    set_run_options<3>(command_, arguments_, volume.voxel_size(), out);
    if (arguments_.initial.any()) set_initial_surface(out, space, volume);
    out.solids.min_volume_mm3 = arguments_.min_component;
    out.solids.fill_cavities = arguments_.fill_cavities;
    out.solids.keep = arguments_.kept();
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
    if (!arguments_.denoised.empty()) write_denoised(volume, result, surface);
    const std::filesystem::path path(arguments_.output);
    for (std::size_t i = 1; i < result.candidates.size() && int(i) <= arguments_.candidates; ++i)
      surf::io::write_surface((path.parent_path() / fmt::format("{}-{}{}", path.stem().string(),
                                                                i + 1, path.extension().string()))
                                  .string(),
                              result.candidates[i].shape, options);
  }

  void write_denoised(const surf::volume::Volume& volume,
                      const surf::segment::SegmentResult& result,
                      const surf::Triangles& surface) const {
    if (const auto model = surf::segment::piecewise_smooth<3>(result.energies))
      surf::volume::write_volume(arguments_.denoised,
                                 surf::segment::denoised(volume, surface, model->mu));
  }

  ordered_json summarise(const surf::segment::SegmentResult& result, const surf::Triangles& surface,
                         const surf::mesh::Verification& verification, ExitCode exit_code) const {
    ordered_json out;
    out["surfseg"] = SURFSEG_VERSION;
    out["config"] = dump_config(command_, {"help", "config", "json"});
    out["exit_code"] = int(exit_code);
    out.update(outcome_of<3>(result));
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
    out.update(history_of<3>(result));
    out["stages"] = clock_.stages();
    out["time_s"] = clock_.total_seconds();
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
    if (!result.stages.empty()) progress_.note(conclusion_of<3>(result));
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
};

void add_options(CLI::App& command, Arguments& a) {
  command.add_option(
      "VOLUME", a.volume,
      "NIfTI, MetaImage, NRRD, VTI or OpenVDB file, a DICOM folder or one of its files");
  command.add_option("-o,--output", a.output, "Surface to write: .stl, .obj, .ply or .vtp");
  command.add_option("--frame-index", a.frame_index, "Frame of a 4-D volume, from 0")
      ->capture_default_str();

  add_start_options(command, a, kWords);
  const std::string start = "Where to start";
  command.add_option("--space", a.space, "Space of the points: ras or lps in mm, or ijk voxels")
      ->check(CLI::IsMember({"ras", "lps", "ijk"}))
      ->capture_default_str()
      ->group(start);
  command
      .add_option("--initial", a.initial.file,
                  "Initial surface of an evolution in place of seed balls: a mesh or a label map")
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
  command
      .add_option(
          "--landmarks", a.initial.landmarks,
          "Or the ellipsoid next to points on the object: Slicer's .mrk.json or .fcsv, or X Y "
          "Z a line in --space")
      ->group(start);
  command.add_option("--initial-label", a.initial.label, "Label to take from the label map")
      ->capture_default_str()
      ->group(start);
  add_run_options(command, a, kWords);

  const std::string output = "Output and running";
  command.add_option("--output-space", a.output_space, "Frame of the file: lps (as Slicer) or ras")
      ->check(CLI::IsMember({"lps", "ras"}))
      ->capture_default_str()
      ->group(output);
  command
      .add_option("--mask", a.mask, "Label map on the volume's grid: .nii.gz, .nii, .mha, .nrrd")
      ->group(output);
  command
      .add_option("--denoised", a.denoised,
                  "Volume approximated smoothly inside and outside the surface, which "
                  "mumford-shah finds along with it: .nii.gz, .nii, .mha, .nrrd")
      ->group(output);
  command
      .add_option("--candidates", a.candidates, "Write up to this many further candidate surfaces")
      ->capture_default_str()
      ->group(output);
  add_running_options(command, a);
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
