// curveseg: contours from images and slices of volumes.
#include "tools/common/program.h"
#include "tools/curveseg/commands.h"

int main(int argc, char** argv) {
  using namespace surfseg;
  using namespace surfseg::curve_program;
  return run_program(
      {.name = "curveseg",
       .version = SURFSEG_VERSION,
       .description =
           "Turn an image, or a slice of a CT or MRI volume, into closed sub-pixel contours.",
       .result = "contour",
       .verbs = {add_info_command, add_segment_command, add_replay_command, add_stack_command,
                 add_phantom_command, add_evaluate_command}},
      argc, argv);
}
