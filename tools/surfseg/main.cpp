// surfseg: surfaces from CT and MRI volumes.
#include "tools/common/program.h"
#include "tools/surfseg/commands.h"

int main(int argc, char** argv) {
  using namespace surfseg;
  ExitCode exit_code = kDone;
  CLI::App app{"Turn a CT or MRI volume into a closed, manifold, sub-voxel surface mesh.",
               "surfseg"};
  app.set_version_flag("--version", "surfseg " SURFSEG_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer(exit_code_help("surface"));
  add_info_command(app, exit_code);
  add_segment_command(app, exit_code);
  add_phantom_command(app, exit_code);
  add_evaluate_command(app, exit_code);
  add_render_command(app, exit_code);
  return run_program(app, argc, argv, exit_code);
}
