// curveseg replay: a recipe in, the contours that it makes again out.
#include "tools/common/replay.h"

#include <fmt/format.h>

#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/segment.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/common/option_group.h"
#include "tools/common/outputs.h"
#include "tools/common/segment_command.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/curve_run.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using surf::curve::Image;

struct Arguments : ReplayArguments {
  ImageArguments image;
  std::string output, output_space = "lps", mask;
};

class ReplayCommand : public SegmentCommand<2> {
 public:
  ReplayCommand(const CLI::App& command, const Arguments& arguments)
      : SegmentCommand<2>(command, arguments), arguments_(arguments) {}

 protected:
  void check() const override {
    check_contour_output(arguments_.output);
    if (!arguments_.mask.empty() && surf::extension(arguments_.mask) != ".png")
      throw surf::UsageError(
          fmt::format("--mask: {}: expected a name that ends in .png", arguments_.mask));
    check_range("--threads", arguments_.threads, 0, "0 (all) or more");
    check_outputs(
        {{"-o", arguments_.output}, {"--mask", arguments_.mask}, {"--json", arguments_.json}},
        arguments_.path);
  }

  Input read() override {
    recipe_ = read_recipe(arguments_);
    ImageArguments which = arguments_.image;
    which.path = image_file(arguments_, recipe_, which.path, "--image");
    for (const std::string& output : {arguments_.output, arguments_.mask})
      check_outputs({{"-o, --mask", output}}, which.path);
    path_ = which.path;
    image_ = which.read();
    for (const std::string& note : image_->source().notes) progress().note("note: " + note);
    return {surf::curve::make_setting(*image_), {}};
  }

  Objects segment(const Input& input) override {
    return replayed<2>(arguments_, recipe_, arguments_.output, input.setting, on_step());
  }

  std::vector<std::string> idle_options() const override { return {}; }
  std::string output() const override { return arguments_.output; }
  std::string image_path() const override { return path_; }
  const char* program() const override { return "curveseg"; }

  void write(const surf::segment::Object<2>& object,
             const surf::segment::Finished<2>& finished) const override {
    write_shape(object_path(arguments_.output, object.name), finished);
  }

  void write_together(const surf::Segments&,
                      const std::vector<surf::segment::Click<2>>&) const override {}

  /// One object is white, 255; where -o asks for all of several they have their labels.
  void write_labels(const std::vector<std::uint8_t>& labels) const override {
    if (arguments_.mask.empty()) return;
    if (has_object(arguments_.output))
      surf::curve::write_labels(arguments_.mask, image_->size(), labels);
    else
      surf::curve::write_mask(arguments_.mask, image_->size(), labels);
  }

  void write_shape(const std::string& path,
                   const surf::segment::Finished<2>& shape) const override {
    surf::curve::write_contours(path, shape.shape, *image_, file_space(arguments_.output_space));
  }

  std::string describe(const surf::segment::Measures<2>& measures) const override {
    return describe_curves(measures);
  }

 private:
  const Arguments& arguments_;
  std::string recipe_, path_;
  std::optional<Image> image_;
};

void add_options(CLI::App& command, Arguments& a) {
  add_replay_arguments(command, a);
  command.add_option("-o,--output", a.output, "Contours to write: .svg, .json, .vtp or .csv");
  command.add_option("--image", a.image.path, "The image [where the recipe says that it is]");
  add_image_choice(command, a.image);
  const OptionGroup group(command, "Output and running");
  add_output_space(command, a.output_space, "a slice's .vtp", group.name());
  group.add("--mask", a.mask, "Mask on the image's pixels: .png");
}

}  // namespace

void add_replay_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("replay", "Repeat what a recipe says, to the byte");
  add_options(*command, *arguments);
  command->footer(
      "Examples:\n"
      "  curveseg segment head.nii.gz --slice axial:80 --seed 90,110 -o v.json --recipe r.json\n"
      "  curveseg replay r.json --slice axial:80 -o again.json\n"
      "The image's content has to be the same: a hash of it is in the recipe.\n"
      "Exit codes: those of segment; 3 if the recipe is broken, newer or of another image.");
  command->callback(
      [command, arguments, &exit_code] { exit_code = ReplayCommand(*command, *arguments).run(); });
}

}  // namespace surfseg::curve_program
