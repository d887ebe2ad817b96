#include "tools/common/signals.h"

#include <csignal>
#include <mutex>

namespace surfseg {
namespace {

volatile std::sig_atomic_t received = 0;

void remember(int signal) {
  received = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_signals() {
  static std::once_flag is_set;
  std::call_once(is_set, [] {
    std::signal(SIGINT, remember);
    std::signal(SIGTERM, remember);
  });
}

void take_file_limits_as_errors() { std::signal(SIGXFSZ, SIG_IGN); }

ExitCode signal_exit_code() {
  if (received == SIGINT) return kInterrupted;
  if (received == SIGTERM) return kTerminated;
  return kDone;
}

}  // namespace surfseg
