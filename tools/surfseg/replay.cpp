// surfseg replay: a recipe in, the surface that it makes again out.
#include <fmt/format.h>

#include <CLI/App.hpp>

#include "libsurf/io/write_surface.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/option_group.h"
#include "tools/common/replay_command.h"
#include "tools/common/verb.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/slice_picture.h"
#include "tools/surfseg/surface_command.h"

namespace surfseg {
namespace {

struct Arguments : ReplayArguments, SurfaceFiles {};

void add_options(CLI::App& command, Arguments& a) {
  add_replay_arguments(command, a);
  command.add_option("-o,--output", a.output,
                     fmt::format("Surface to write: {}", surf::io::writable_surfaces()));
  command.add_option("--volume", a.volume, "The volume [where the recipe says that it is]");
  a.which.add_to(command);
  const OptionGroup group(command, "Output and running");
  add_output_space(command, a.output_space, "the file", group.name());
  group.add("--mask", a.mask,
            fmt::format("Label map on the volume's grid: {}", surf::volume::writable_label_maps()));
  add_picture_option(command, a.picture, group.name());
  add_thumbnail_option(command, a.thumbnail, group.name());
  add_report_options(command, a, group.name());
}

}  // namespace

void add_replay_command(CLI::App& app, ExitCode& exit_code) {
  add_verb<ReplayCommand<SurfaceCommand>>(
      app, exit_code,
      replay_text(
          "  surfseg segment ct.nii.gz --seed 12,-30,44 -o kidney.stl --recipe kidney.json\n"
          "  surfseg replay kidney.json -o again.stl\n",
          "volume"),
      add_options);
}

}  // namespace surfseg
