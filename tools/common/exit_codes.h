// Exit codes of every program, documented in docs/exit-codes.md and the man pages.
#pragma once

namespace surfseg {

enum ExitCode {
  kDone = 0,
  kInternal = 1,        ///< a bug: please report
  kUsage = 2,           ///< wrong option or argument
  kInput = 3,           ///< unreadable, broken or unsupported input
  kOutput = 4,          ///< an output could not be written
  kStoppedAtLimit = 5,  ///< iteration or time limit; the result was written
  kInvalidResult = 6,   ///< the surface fails a guarantee and was not written
  kBatchFailed = 7,     ///< some cases of a batch, or of several objects, failed
  kNoObject = 8,        ///< no object stands out round the clicks, or it vanished
  kInterrupted = 130,   ///< SIGINT; the last good surface was written
  kTerminated = 143,    ///< SIGTERM; the last good surface was written
  kCpuLimit = 152       ///< SIGXCPU: ulimit -t; the last good surface was written
};

/// Whether a signal has ended the run.
constexpr bool is_of_signal(ExitCode code) { return code >= kInterrupted; }

}  // namespace surfseg
