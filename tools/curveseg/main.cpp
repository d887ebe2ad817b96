// curveseg: contours from images and from slices of volumes.
#include "tools/common/program.h"
#include "tools/curveseg/commands.h"

int main(int argc, char** argv) {
  using namespace surfseg;
  ExitCode exit_code = kDone;
  CLI::App app{"Turn an image, or a slice of a CT or MRI volume, into closed sub-pixel contours.",
               "curveseg"};
  app.set_version_flag("--version", "curveseg " SURFSEG_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(exit_code_help("contour"));
  curve_program::add_info_command(app, exit_code);
  curve_program::add_segment_command(app, exit_code);
  curve_program::add_stack_command(app, exit_code);
  curve_program::add_phantom_command(app, exit_code);
  curve_program::add_evaluate_command(app, exit_code);
  return run_program(app, argc, argv, exit_code);
}
