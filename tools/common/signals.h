// Ctrl-C, SIGTERM and a limit of CPU time: the run ends soon after with its last good surface.
#pragma once

#include <stop_token>
#include <thread>

#include "tools/common/exit_codes.h"

namespace surfseg {

/// Catches SIGINT, SIGTERM and SIGXCPU once; a second one of the first two ends the process at
/// once, as the hard limit of CPU time does. Further calls do nothing; any thread may make them.
void catch_signals();

/// From here on a file that grows beyond its limit (ulimit -f) is an error of writing, which leaves
/// nothing behind, not the end of the process.
void take_file_limits_as_errors();

/// kDone, or kInterrupted / kTerminated / kCpuLimit once a signal has come.
ExitCode signal_exit_code();

/// Requests a stop soon after a signal has come (20 ms), as long as it lives: what takes long
/// between two steps hears of it, too. A handler may not request one itself.
class SignalStop {
 public:
  SignalStop();
  std::stop_token token() const { return stop_.get_token(); }

 private:
  std::stop_source stop_;
  std::jthread watch_;  // ends first
};

}  // namespace surfseg
