// curveseg stack: contours of consecutive slices of a volume, each started from the last one's.
#include <fmt/format.h>

#include <cstdlib>
#include <memory>

#include "libcurve/image/slice.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/config.h"
#include "tools/common/outputs.h"
#include "tools/common/preset_arguments.h"
#include "tools/common/progress.h"
#include "tools/common/report.h"
#include "tools/common/run_report.h"
#include "tools/common/signals.h"
#include "tools/common/stage_clock.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/curve_run.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using nlohmann::ordered_json;
using surf::Segments;
using surf::curve::CurveOptions;
using surf::curve::CurveResult;
using surf::curve::Image;
using surf::curve::SliceContours;
using surf::curve::VoxelSlices;

struct Arguments : CurveArguments {
  std::string volume, output, output_space = "lps", mask, plane = "axial";
  VolumeArguments which;
  int from = 0, to = 0;
};

/// Curves of one slice in the plane of another one.
Segments carried(const Segments& curves, const Eigen::Affine3d& from, const Eigen::Affine3d& to) {
  Segments out = curves;
  const Eigen::Affine3d map = to.inverse() * from;
  for (auto point : out.points.rowwise()) {
    const Eigen::Vector3d in(point[0], point[1], 0);
    point = (map * in).head<2>().transpose();
  }
  return out;
}

class StackCommand {
 public:
  StackCommand(const CLI::App& command, const Arguments& arguments)
      : command_(command), arguments_(arguments), progress_(arguments.verbosity()) {}

  ExitCode run() {
    check();
    std::unique_ptr<surf::ThreadLimit> limit;
    if (arguments_.threads > 0) limit = std::make_unique<surf::ThreadLimit>(arguments_.threads);
    clock_.begin("read");
    const auto volume = arguments_.which.read(arguments_.volume);
    for (const std::string& note : volume.source().notes) progress_.note("note: " + note);
    const VoxelSlices slices(volume, parse_slice_plane("--slices", arguments_.plane));
    for (const std::string& idle : idle_curve_options(command_, arguments_))
      progress_.note("note: " + idle);
    catch_signals();
    clock_.begin("segment");
    const int step = arguments_.from <= arguments_.to ? 1 : -1;
    for (int k = arguments_.from; k != arguments_.to + step && go_on_; k += step) add(slices, k);
    clock_.begin("write");
    if (stack_.empty())
      throw surf::InvalidMesh(fmt::format("{}: not written: {}", arguments_.output,
                                          notes_.empty() ? "no slice" : notes_.back()));
    write(slices);
    clock_.end();
    if (!arguments_.json.empty()) write_json(arguments_.json, summarise());
    for (const std::string& note : notes_) progress_.note("note: " + note);
    progress_.note(fmt::format("{}: {} slices, {:.2f} s", arguments_.output, stack_.size(),
                               clock_.total_seconds()));
    return exit_code_;
  }

 private:
  void check() const {
    if (arguments_.volume.empty()) throw surf::UsageError("VOLUME: a volume is missing");
    if (arguments_.output.empty())
      throw surf::UsageError("-o: an output file is missing, such as -o cord.vtp");
    const std::string ending = surf::extension(arguments_.output);
    if (ending != ".json" && ending != ".vtp" && ending != ".csv")
      throw surf::UsageError(fmt::format("-o: {}: expected a name that ends in .json, .vtp or .csv",
                                         arguments_.output));
    if (!arguments_.mask.empty() && !surf::volume::is_writable_volume(arguments_.mask))
      throw surf::UsageError(
          fmt::format("--mask: {}: expected a name that ends in .nii.gz, .nii, .mha or .nrrd",
                      arguments_.mask));
    arguments_.which.check();
    if (command_.count("--from") == 0 || command_.count("--to") == 0)
      throw surf::UsageError("--from, --to: the first and the last slice are needed");
    check_curve_arguments(command_, arguments_);
    check_outputs(
        {{"-o", arguments_.output}, {"--mask", arguments_.mask}, {"--json", arguments_.json}},
        arguments_.volume);
  }

  /// The first slice starts as the options say, the others from the one before, with the energy
  /// that was chosen on the first.
  CurveOptions options_for(const Image& image) const {
    CurveOptions options = curve_options(command_, arguments_, image);
    if (stack_.empty()) return options;
    options.seeds_mm.clear();
    if (options.regions.keep == surf::mesh::Keep::kSeeded)
      options.regions.keep = surf::mesh::Keep::kAll;
    options.initial =
        carried(stack_.back().curves, stack_.back().plane_to_ras, *image.plane_to_ras());
    options.energies = energies_;
    return options;
  }

  void add(const VoxelSlices& slices, int k) {
    const Image image = slices.slice(k);
    const CurveResult result = surf::curve::segment(
        image, options_for(image),
        [&](const std::string& stage, const surf::flow::StepRecord& record, const auto&) {
          progress_.step(step_line(fmt::format("slice {} {}", k, stage), record, "elements", "area",
                                   "mm^2", clock_.total_seconds()));
          return signal_exit_code() == kDone;
        });
    if (const ExitCode code = exit_code_of<2>(result); code != kDone) exit_code_ = code;
    if (signal_exit_code() != kDone) go_on_ = false;
    const auto verification = surf::curve::verify(result.shape);
    const bool has_vanished = !result.stages.empty() && result.main_stage().flow.termination ==
                                                            surf::flow::Termination::kObstacle;
    if (has_vanished || !verification.passed()) {
      notes_.push_back(
          fmt::format("slice {}: {}; the stack ends before it", k,
                      has_vanished ? result.main_stage().flow.message : verification.message()));
      go_on_ = false;
      return;
    }
    if (energies_.empty()) energies_ = result.energies;
    records_.push_back(
        {{"slice", k},
         {"area_mm2",
          surf::fem::Geometry<2>(result.shape.points, result.shape.elements).enclosed()},
         {"components", verification.n_components},
         {"elements", verification.n_elements}});
    stack_.push_back({k, result.shape, *image.plane_to_ras()});
  }

  void write(const VoxelSlices& slices) const {
    surf::curve::write_stack(
        arguments_.output, stack_,
        arguments_.output_space == "ras" ? surf::io::Space::kRas : surf::io::Space::kLps);
    if (arguments_.mask.empty()) return;
    const auto& volume = slices.volume();
    const auto& size = volume.size();
    std::vector<std::uint8_t> labels(volume.n_voxels(), 0);
    for (const SliceContours& slice : stack_) {
      const Image image = slices.slice(slice.slice);
      const auto mask = surf::curve::rasterize(slice.curves, image.size(), image.pixel_to_plane());
      for (int j = 0; j < image.size()[1]; ++j)
        for (int i = 0; i < image.size()[0]; ++i) {
          const auto v = slices.voxel(i, j, slice.slice);
          labels[(std::size_t(v[2]) * size[1] + v[1]) * size[0] + v[0]] =
              mask[std::size_t(j) * image.size()[0] + i];
        }
    }
    surf::volume::write_label_map(arguments_.mask, size, volume.index_to_world(), labels);
  }

  ordered_json summarise() const {
    ordered_json out;
    out["curveseg"] = SURFSEG_VERSION;
    out["config"] = dump_config(command_, {"help", "config", "json"});
    out["exit_code"] = int(exit_code_);
    out["slices"] = records_;
    out["notes"] = notes_;
    out["stages"] = clock_.stages();
    out["time_s"] = clock_.total_seconds();
    out["peak_memory_mb"] = peak_memory_mb();
    return out;
  }

  const CLI::App& command_;
  const Arguments& arguments_;
  ProgressLine progress_;
  StageClock clock_;
  ExitCode exit_code_ = kDone;
  bool go_on_ = true;
  std::vector<SliceContours> stack_;
  std::vector<surf::segment::EnergyTerm> energies_;
  std::vector<std::string> notes_;
  ordered_json records_ = ordered_json::array();
};

void add_options(CLI::App& command, Arguments& a) {
  command.add_option("VOLUME", a.volume, "Any volume that surfseg reads");
  command.add_option("-o,--output", a.output, "Contours to write: .json, .vtp or .csv");
  const std::string group = "Which slices";
  command.add_option("--from", a.from, "First slice, by its voxel index: where the seeds are")
      ->group(group);
  command.add_option("--to", a.to, "Last slice; may be less than the first")->group(group);
  command.add_option("--slices", a.plane, "axial, sagittal or coronal")
      ->check(CLI::IsMember({"axial", "sagittal", "coronal"}))
      ->capture_default_str()
      ->group(group);
  a.which.add_to(command, group);
  add_curve_options(command, a);
  const std::string output = "Output and running";
  command.add_option("--output-space", a.output_space, "Frame of the file: lps (as Slicer) or ras")
      ->check(CLI::IsMember({"lps", "ras"}))
      ->capture_default_str()
      ->group(output);
  command
      .add_option("--mask", a.mask, "Label map on the volume's grid: .nii.gz, .nii, .mha, .nrrd")
      ->group(output);
  add_running_options(command, a);
}

}  // namespace

void add_stack_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "stack", "Follow contours through the slices of a volume, each started from the last");
  add_options(*command, *arguments);
  command->footer(
      "Example:\n"
      "  curveseg stack spine.nii.gz --from 20 --to 45 --space ras --seed 3,-20,35 -o cord.vtp \\\n"
      "          --mask cord.nii.gz\n"
      "Contours are in the world. Where the object ends, so does the stack, with a note.");
  command->callback([command, arguments, &exit_code] {
    apply_files(*command, arguments->config, arguments->preset);
    exit_code = StackCommand(*command, *arguments).run();
  });
}

}  // namespace surfseg::curve_program
