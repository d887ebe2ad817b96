#include "tools/common/signals.h"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>

namespace surfseg {
namespace {

std::atomic<int> received = 0;  // read by the studio's threads, too
static_assert(std::atomic<int>::is_always_lock_free);

/// The second one of a kind ends the program at once.
void remember(int signal) {
  const int error = errno;  // of what was interrupted
  received = signal;
  std::signal(signal, SIG_DFL);
  errno = error;
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
