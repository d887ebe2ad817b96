#include "tools/surfseg/commands.h"

namespace surfseg {

void add_evaluate_command(CLI::App&, ExitCode&) {}

}  // namespace surfseg
