// curveseg segment: an image and seeds in, verified contours out.
#include "libcurve/segment/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/threads.h"
#include "libsurf/segment/energy_assembly.h"
#include "tools/common/config.h"
#include "tools/common/outputs.h"
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
using surf::curve::CurveResult;
using surf::curve::Image;
using surf::curve::Verification;

struct Arguments : CurveArguments {
  ImageArguments image;
  std::string output, output_space = "lps", mask, overlay, frames, denoised;
};

ordered_json regions_of(const Segments& curves) {
  const auto hierarchy = surf::curve::curve_hierarchy(curves);
  ordered_json out = ordered_json::array();
  for (const auto& region : surf::curve::regions(hierarchy)) {
    const auto& centre = hierarchy.components[region.outer].centre;
    out.push_back({{"area_mm2", region.area_mm2},
                   {"length_mm", region.length_mm},
                   {"center_mm", {centre[0], centre[1]}},
                   {"holes", region.holes.size()}});
  }
  return out;
}

/// Pictures of the evolution, one for each step.
class Frames {
 public:
  Frames(const std::string& folder, const Image& image) : folder_(folder), image_(image) {}

  void add(const Segments& curves) {
    if (folder_.empty()) return;
    const auto name = fmt::format("frame-{:05}.png", n_++);
    surf::io::write_png((std::filesystem::path(folder_) / name).string(),
                        surf::curve::draw_overlay(image_, curves));
  }

 private:
  std::string folder_;
  const Image& image_;
  int n_ = 0;
};

class SegmentCommand {
 public:
  SegmentCommand(const CLI::App& command, const Arguments& arguments)
      : command_(command), arguments_(arguments), progress_(arguments.verbosity()) {}

  ExitCode run() {
    check();
    std::unique_ptr<surf::ThreadLimit> limit;
    if (arguments_.threads > 0) limit = std::make_unique<surf::ThreadLimit>(arguments_.threads);
    clock_.begin("read");
    const Image image = arguments_.image.read();
    for (const std::string& note : image.source().notes) progress_.note("note: " + note);
    const auto options = curve_options(command_, arguments_, image);
    catch_signals();
    clock_.begin("segment");
    Frames frames(arguments_.frames, image);
    const CurveResult result = surf::curve::segment(
        image, options,
        [&](const std::string& stage, const surf::flow::StepRecord& record, const auto& curves) {
          progress_.step(
              step_line(stage, record, "elements", "area", "mm^2", clock_.total_seconds()));
          if (!arguments_.frames.empty()) frames.add(curves());
          return signal_exit_code() == kDone;
        });
    clock_.begin("verify");
    const Verification verification = surf::curve::verify(result.shape);
    clock_.begin("write");
    ExitCode exit_code = exit_code_of<2>(result);
    if (verification.passed())
      write(image, options, result);
    else
      exit_code = kInvalidResult;
    clock_.end();
    const ordered_json summary = summarise(result, verification, exit_code);
    if (!arguments_.json.empty()) write_json(arguments_.json, summary);
    conclude(result, summary, verification);
    if (exit_code == kInvalidResult)
      throw surf::InvalidMesh(fmt::format("{}: not written: {}", arguments_.output,
                                          result.shape.elements.rows() == 0
                                              ? "nothing is left; see --min-component and --keep"
                                              : verification.message()));
    return exit_code;
  }

 private:
  void check() const {
    if (arguments_.output.empty())
      throw surf::UsageError("-o: an output file is missing, such as -o liver.json");
    if (!surf::curve::is_writable_contour(arguments_.output))
      throw surf::UsageError(fmt::format(
          "-o: {}: expected a name that ends in .svg, .json, .vtp or .csv", arguments_.output));
    for (const auto& [option, path] :
         {std::pair{"--mask", arguments_.mask}, {"--overlay", arguments_.overlay}})
      if (!path.empty() && surf::extension(path) != ".png")
        throw surf::UsageError(
            fmt::format("{}: {}: expected a name that ends in .png", option, path));
    if (!arguments_.denoised.empty() && !surf::curve::is_writable_image(arguments_.denoised))
      throw surf::UsageError(fmt::format(
          "--denoised: {}: expected a name that ends in .png or .tif", arguments_.denoised));
    check_curve_arguments(command_, arguments_);
    if (!arguments_.denoised.empty() &&
        !surf::segment::is_piecewise_smooth<2>(arguments_.terms(command_)))
      throw surf::UsageError("--denoised: belongs to --energy mumford-shah, which is not used");
    arguments_.image.check();
    check_outputs({{"-o", arguments_.output},
                   {"--mask", arguments_.mask},
                   {"--overlay", arguments_.overlay},
                   {"--denoised", arguments_.denoised},
                   {"--json", arguments_.json}},
                  arguments_.image.path);
    if (!arguments_.frames.empty() && !std::filesystem::is_directory(arguments_.frames))
      throw surf::OutputError(
          fmt::format("--frames: the folder {} does not exist", arguments_.frames));
  }

  void write(const Image& image, const surf::curve::CurveOptions& options,
             const CurveResult& result) const {
    const Segments& curves = result.shape;
    surf::curve::write_contours(
        arguments_.output, curves, image,
        arguments_.output_space == "ras" ? surf::io::Space::kRas : surf::io::Space::kLps);
    if (!arguments_.mask.empty())
      surf::curve::write_mask(arguments_.mask, image.size(),
                              surf::curve::rasterize(curves, image.size(), image.pixel_to_plane()));
    if (!arguments_.overlay.empty())
      surf::io::write_png(arguments_.overlay, surf::curve::draw_overlay(image, curves));
    if (!arguments_.denoised.empty())
      surf::curve::write_image(arguments_.denoised, surf::curve::denoised(image, options, result));
  }

  ordered_json summarise(const CurveResult& result, const Verification& verification,
                         ExitCode exit_code) const {
    ordered_json out;
    out["curveseg"] = SURFSEG_VERSION;
    out["config"] = dump_config(command_, {"help", "config", "json"});
    out["exit_code"] = int(exit_code);
    out.update(outcome_of<2>(result));
    out["vertices"] = result.shape.points.rows();
    out["elements"] = result.shape.elements.rows();
    out["closed"] = verification.closed;
    out["simple"] = verification.simple;
    out["alternating"] = verification.alternating;
    out["components"] = verification.n_components;
    out["self_intersections"] = verification.n_intersections;
    out["border_share"] = result.border_share;
    if (verification.passed()) {
      out["regions"] = regions_of(result.shape);
      double area = 0, length = 0;
      for (const auto& region : out["regions"]) {
        area += region["area_mm2"].get<double>();
        length += region["length_mm"].get<double>();
      }
      out["area_mm2"] = area;
      out["length_mm"] = length;
    }
    out.update(history_of<2>(result));
    out["stages"] = clock_.stages();
    out["time_s"] = clock_.total_seconds();
    out["peak_memory_mb"] = peak_memory_mb();
    return out;
  }

  void conclude(const CurveResult& result, const ordered_json& summary,
                const Verification& verification) {
    for (const std::string& note : result.notes) progress_.note("note: " + note);
    if (result.border_share > 0)
      progress_.note(
          fmt::format("note: the curve meets the image's border with {:.1f} % of its length",
                      100 * result.border_share));
    if (!result.stages.empty()) progress_.note(conclusion_of<2>(result));
    if (verification.passed())
      progress_.note(fmt::format(
          "{}: {} elements, {} regions, {:.5g} mm^2, {:.5g} mm, closed, simple, {:.2f} s",
          arguments_.output, summary["elements"].get<int>(), summary["regions"].size(),
          summary["area_mm2"].get<double>(), summary["length_mm"].get<double>(),
          summary["time_s"].get<double>()));
  }

  const CLI::App& command_;
  const Arguments& arguments_;
  ProgressLine progress_;
  StageClock clock_;
};

void add_options(CLI::App& command, Arguments& a) {
  add_image_arguments(command, a.image);
  command.add_option("-o,--output", a.output, "Contours to write: .svg, .json, .vtp or .csv");
  add_curve_options(command, a);
  const std::string output = "Output and running";
  command
      .add_option("--output-space", a.output_space,
                  "Frame of a slice's .vtp: lps (as Slicer) or ras")
      ->check(CLI::IsMember({"lps", "ras"}))
      ->capture_default_str()
      ->group(output);
  command.add_option("--mask", a.mask, "Mask on the image's pixels: .png")->group(output);
  command.add_option("--overlay", a.overlay, "Picture of the contours over the image: .png")
      ->group(output);
  command
      .add_option("--denoised", a.denoised,
                  "With mumford-shah: the piecewise smooth image: .tif, or .png with its range "
                  "mapped to 0..65535")
      ->group(output);
  command.add_option("--frames", a.frames, "Folder for such a picture of every step")
      ->group(output);
  add_running_options(command, a);
}

}  // namespace

void add_segment_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("segment", "Grow or shrink curves in an image");
  add_options(*command, *arguments);
  command->footer(
      "Examples:\n"
      "  curveseg segment cells.png --seeds-grid 20px --energy chan-vese -o cells.svg --mask "
      "cells-mask.png\n"
      "  curveseg segment ring.tif --circle 128,128,120px --energy chan-vese --open-cavities \\\n"
      "          -o ring.json --overlay ring.png\n"
      "  curveseg segment head.nii.gz --slice axial:80 --seed 90,110 -o ventricle.json\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 output, 5 stopped at the iteration limit (result\n"
      "written), 6 result fails a guarantee (not written), 130/143 interrupted (last curves "
      "written).");
  command->callback([command, arguments, &exit_code] {
    if (!arguments->config.empty()) apply_config(*command, arguments->config);
    exit_code = SegmentCommand(*command, *arguments).run();
  });
}

}  // namespace surfseg::curve_program
