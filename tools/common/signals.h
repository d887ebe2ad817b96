// Ctrl-C and SIGTERM: the run ends at the next step with its last good surface.
#pragma once

#include "tools/common/exit_codes.h"

namespace surfseg {

/// Catches SIGINT and SIGTERM once; a second one ends the process at once. Further calls do
/// nothing; any thread may make them.
void catch_signals();

/// kDone, or kInterrupted / kTerminated once a signal has come.
ExitCode signal_exit_code();

}  // namespace surfseg
