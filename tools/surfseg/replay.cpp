// surfseg replay: a recipe in, the surface that it makes again out.
#include "tools/common/replay.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/option_group.h"
#include "tools/common/outputs.h"
#include "tools/common/segment_command.h"
#include "tools/common/volume_arguments.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/slice_picture.h"

namespace surfseg {
namespace {

struct Arguments : ReplayArguments {
  std::string volume, output, output_space = "lps", mask, picture;
  VolumeArguments which;
};

class ReplayCommand : public SegmentCommand<3> {
 public:
  ReplayCommand(const CLI::App& command, const Arguments& arguments)
      : SegmentCommand<3>(command, arguments), arguments_(arguments) {}

 protected:
  void check() const override {
    if (arguments_.output.empty())
      throw surf::UsageError("-o: an output file is missing, such as -o liver.stl");
    if (!surf::io::is_writable_surface(arguments_.output))
      throw surf::UsageError(fmt::format(
          "-o: {}: expected a name that ends in .stl, .obj, .ply or .vtp", arguments_.output));
    if (!arguments_.mask.empty() && !surf::volume::is_writable_volume(arguments_.mask))
      throw surf::UsageError(
          fmt::format("--mask: {}: expected a name that ends in .nii.gz, .nii, .mha or .nrrd",
                      arguments_.mask));
    check_picture("--picture", arguments_.picture);
    check_range("--threads", arguments_.threads, 0, "0 (all) or more");
    arguments_.which.check();
    check_outputs({{"-o", arguments_.output},
                   {"--mask", arguments_.mask},
                   {"--picture", arguments_.picture},
                   {"--json", arguments_.json}},
                  arguments_.path);
  }

  Input read() override {
    recipe_ = read_recipe(arguments_);
    path_ = image_file(arguments_, recipe_, arguments_.volume, "--volume");
    for (const std::string& output : {arguments_.output, arguments_.mask})
      check_outputs({{"-o, --mask", output}}, path_);
    volume_ = arguments_.which.read(path_);
    for (const std::string& note : volume_->source().notes) progress().note("note: " + note);
    return {surf::segment::make_setting(*volume_), {}};
  }

  Objects segment(const Input& input) override {
    return replayed<3>(arguments_, recipe_, arguments_.output, input.setting, on_step());
  }

  std::vector<std::string> idle_options() const override { return {}; }
  std::string output() const override { return arguments_.output; }
  std::string image_path() const override { return path_; }
  const char* program() const override { return "surfseg"; }

  void write(const surf::segment::Object<3>& object,
             const surf::segment::Finished<3>& finished) const override {
    write_shape(object_path(arguments_.output, object.name), finished);
    if (has_object(arguments_.picture))
      write_picture(object_path(arguments_.picture, object.name), finished.shape, *volume_,
                    object.clicks);
  }

  void write_together(const surf::Triangles& all,
                      const std::vector<surf::segment::Click<3>>& clicks) const override {
    if (!has_object(arguments_.picture)) write_picture(arguments_.picture, all, *volume_, clicks);
  }

  void write_labels(const std::vector<std::uint8_t>& labels) const override {
    if (!arguments_.mask.empty())
      surf::volume::write_label_map(arguments_.mask, volume_->size(), volume_->index_to_world(),
                                    labels);
  }

  void write_shape(const std::string& path,
                   const surf::segment::Finished<3>& shape) const override {
    surf::segment::write(path, shape, {file_space(arguments_.output_space)});
  }

  std::string describe(const surf::segment::Measures<3>& measures) const override {
    return describe_surface(measures);
  }

 private:
  const Arguments& arguments_;
  std::string recipe_, path_;
  std::optional<surf::volume::Volume> volume_;
};

void add_options(CLI::App& command, Arguments& a) {
  add_replay_arguments(command, a);
  command.add_option("-o,--output", a.output, "Surface to write: .stl, .obj, .ply or .vtp");
  command.add_option("--volume", a.volume, "The volume [where the recipe says that it is]");
  a.which.add_to(command);
  const OptionGroup group(command, "Output and running");
  add_output_space(command, a.output_space, "the file", group.name());
  group.add("--mask", a.mask, "Label map on the volume's grid: .nii.gz, .nii, .mha, .nrrd");
  add_picture_option(command, a.picture, group.name());
}

}  // namespace

void add_replay_command(CLI::App& app, ExitCode& exit_code) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("replay", "Repeat what a recipe says, to the byte");
  add_options(*command, *arguments);
  command->footer(
      "Examples:\n"
      "  surfseg segment ct.nii.gz --seed 12,-30,44 -o kidney.stl --recipe kidney.json\n"
      "  surfseg replay kidney.json -o again.stl\n"
      "The volume's content has to be the same: a hash of it is in the recipe.\n"
      "Exit codes: those of segment; 3 if the recipe is broken, newer or of another volume.");
  command->callback(
      [command, arguments, &exit_code] { exit_code = ReplayCommand(*command, *arguments).run(); });
}

}  // namespace surfseg
