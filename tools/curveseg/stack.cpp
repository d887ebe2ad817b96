// curveseg stack: contours of consecutive slices of a volume, each started from the last one's.
#include "libcurve/segment/stack.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <memory>

#include "libcurve/image/slice.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/config.h"
#include "tools/common/memory_limit.h"
#include "tools/common/objects.h"
#include "tools/common/option_group.h"
#include "tools/common/outputs.h"
#include "tools/common/progress.h"
#include "tools/common/report.h"
#include "tools/common/segment_command.h"
#include "tools/common/signals.h"
#include "tools/common/stage_clock.h"
#include "tools/common/verb.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/curve_run.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using nlohmann::ordered_json;
using surf::curve::VoxelSlices;

struct Arguments : CurveArguments {
  std::string volume, output, output_space = "lps", mask, plane = "axial";
  VolumeArguments which;
  int from = 0, to = 0;
};

class StackCommand {
 public:
  StackCommand(const CLI::App& command, const Arguments& arguments)
      : command_(command), arguments_(arguments), progress_(arguments.verbosity()) {}

  ExitCode run() {
    check();
    limit_memory(arguments_.memory);
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
    const surf::curve::Image first = slices.slice(arguments_.from);
    surf::curve::CurveOptions options = curve_options(command_, arguments_, first);
    const auto boxes = boxes_mm(arguments_, first);
    if (boxes.size() > 1)
      throw surf::UsageError(fmt::format("--box: {} boxes; a stack has one", boxes.size()));
    if (!boxes.empty()) options.box_mm = boxes[0];
    result_ = surf::curve::segment_stack(
        slices, arguments_.from, arguments_.to, options,
        [&](int k, const std::string& stage, const surf::flow::StepRecord& record) {
          progress_.step(
              step_line<2>(fmt::format("slice {} {}", k, stage), record, clock_.total_seconds()));
          return signal_exit_code() == kDone;
        });
    exit_code_ = signal_exit_code() != kDone ? signal_exit_code()
                 : result_.n_limited > 0     ? kStoppedAtLimit
                                             : kDone;
    clock_.begin("write");
    if (result_.slices.empty()) fail();
    write(slices);
    summarise();
    for (const std::string& note : result_.notes) progress_.note("note: " + note);
    progress_.note(fmt::format("{}: {} slices, {:.2f} s", arguments_.output, result_.slices.size(),
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
    check_volume_name("--mask", arguments_.mask);
    arguments_.which.check();
    if (command_.count("--from") == 0 || command_.count("--to") == 0)
      throw surf::UsageError("--from, --to: the first and the last slice are needed");
    check_curve_arguments(command_, arguments_);
    check_outputs(
        {{"-o", arguments_.output}, {"--mask", arguments_.mask}, {"--json", arguments_.json}},
        read_files(arguments_, {{"the input", arguments_.volume},
                                {"--contour", arguments_.contour},
                                {"--landmarks", arguments_.landmarks}}));
  }

  /// Where the first slice has no contours.
  [[noreturn]] void fail() {
    const std::string why =
        fmt::format("{}: not written: {}", arguments_.output, result_.notes.back());
    if (result_.is_invalid)
      exit_code_ = kInvalidResult;
    else if (!is_of_signal(exit_code_))
      exit_code_ = kNoObject;
    summarise();
    if (result_.is_invalid) throw surf::InvalidMesh(why);
    throw surf::NoObject(why);
  }

  void write(const VoxelSlices& slices) const {
    surf::curve::write_stack(arguments_.output, result_.slices,
                             file_space(arguments_.output_space));
    if (!arguments_.mask.empty())
      surf::volume::write_label_map(arguments_.mask, slices.volume(),
                                    surf::curve::rasterized(result_.slices, slices));
  }

  ordered_json records() const {
    ordered_json out = ordered_json::array();
    for (const auto& slice : result_.slices) {
      const auto verification = surf::curve::verify(slice.curves);
      out.push_back(
          {{"slice", slice.slice},
           {"area_mm2",
            surf::fem::Geometry<2>(slice.curves.points, slice.curves.elements).enclosed()},
           {"components", verification.n_components},
           {"elements", verification.n_elements}});
    }
    return out;
  }

  /// The summary, if one was asked for.
  void summarise() {
    clock_.end();
    if (arguments_.json.empty()) return;
    ordered_json out;
    out["curveseg"] = SURFSEG_VERSION;
    out["config"] = dump_config(command_, {"help", "config", "json", "memory"});
    out["exit_code"] = int(exit_code_);
    out["slices"] = records();
    out["notes"] = result_.notes;
    out["stages"] = clock_.to_json();
    out["time_s"] = clock_.total_seconds();
    out["peak_memory_mb"] = peak_memory_mb();
    write_json(arguments_.json, out);
  }

  const CLI::App& command_;
  const Arguments& arguments_;
  ProgressLine progress_;
  StageClock clock_;
  ExitCode exit_code_ = kDone;
  surf::curve::StackResult result_;
};

void add_options(CLI::App& command, Arguments& a) {
  command.add_option("VOLUME", a.volume, "Any volume that surfseg reads");
  command.add_option("-o,--output", a.output, "Contours to write: .json, .vtp or .csv");
  const OptionGroup group(command, "Which slices");
  group.add("--from", a.from, "First slice, by its voxel index: where the seeds are");
  group.add("--to", a.to, "Last slice; may be less than the first");
  group.add_choice("--slices", a.plane, "axial, sagittal or coronal",
                   {"axial", "sagittal", "coronal"});
  a.which.add_to(command, group.name());
  add_curve_options(command, a);
  const OptionGroup output(command, "Output and running");
  add_output_space(command, a.output_space, "the file", output.name());
  output.add("--mask", a.mask, "Label map on the volume's grid: .nii.gz, .nii, .mha, .nrrd");
  add_running_options(command, a);
  // They tell of one segmentation; each slice is one.
  for (const char* option : {"--recipe", "--checkpoint", "--resume", "--profile"})
    command.remove_option(command.get_option(option));
}

}  // namespace

void add_stack_command(CLI::App& app, ExitCode& exit_code) {
  add_verb<StackCommand>(
      app, exit_code,
      {"stack", "Follow contours through the slices of a volume, each started from the last",
       "Example:\n"
       "  curveseg stack spine.nii.gz --from 20 --to 45 --space ras --seed 3,-20,35 \\\n"
       "          -o cord.vtp --mask cord.nii.gz\n"
       "Contours are in the world. Where the object ends, so does the stack, with a note."},
      add_options);
}

}  // namespace surfseg::curve_program
