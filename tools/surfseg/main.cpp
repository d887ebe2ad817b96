// surfseg: surfaces from CT and MRI volumes.
#include "tools/common/program.h"
#include "tools/surfseg/commands.h"

int main(int argc, char** argv) {
  using namespace surfseg;
  return run_program(
      {.name = "surfseg",
       .version = SURFSEG_VERSION,
       .description = "Turn a CT or MRI volume into a closed, manifold, sub-voxel surface mesh.",
       .result = "surface",
       .verbs = {add_info_command, add_segment_command, add_replay_command, add_phantom_command,
                 add_evaluate_command, add_render_command, add_batch_command, add_studio_command}},
      argc, argv);
}
