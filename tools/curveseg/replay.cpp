// curveseg replay: a recipe in, the contours that it makes again out.
#include <CLI/App.hpp>

#include "tools/common/option_group.h"
#include "tools/common/replay_command.h"
#include "tools/common/verb.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/curve_command.h"

namespace surfseg::curve_program {
namespace {

struct Arguments : ReplayArguments, CurveFiles {};

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
  add_verb<ReplayCommand<CurveCommand>>(
      app, exit_code,
      replay_text("  curveseg segment head.nii.gz --slice axial:80 --seed 90,110 -o v.json "
                  "--recipe r.json\n"
                  "  curveseg replay r.json --slice axial:80 -o again.json\n",
                  "image"),
      add_options);
}

}  // namespace surfseg::curve_program
