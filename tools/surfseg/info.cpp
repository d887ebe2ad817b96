#include "tools/surfseg/commands.h"

namespace surfseg {

void add_info_command(CLI::App&, ExitCode&) {}

}  // namespace surfseg
