#include "tools/surfseg/commands.h"

namespace surfseg {

void add_phantom_command(CLI::App&, ExitCode&) {}

}  // namespace surfseg
