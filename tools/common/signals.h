// Ctrl-C and SIGTERM: the run ends at the next step with its last good surface.
#pragma once

#include "tools/common/exit_codes.h"

namespace surfseg {

/// Catches SIGINT and SIGTERM once; a second one ends the process at once. Further calls do
/// nothing; any thread may make them.
void catch_signals();

/// From here on a file that grows beyond its limit (ulimit -f) is an error of writing, which leaves
/// nothing behind, not the end of the process.
void take_file_limits_as_errors();

/// kDone, or kInterrupted / kTerminated once a signal has come.
ExitCode signal_exit_code();

}  // namespace surfseg
