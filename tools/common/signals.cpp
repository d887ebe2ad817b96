#include "tools/common/signals.h"

#include <atomic>
#include <csignal>
#include <mutex>

namespace surfseg {
namespace {

std::atomic<int> received = 0;  // read by the studio's threads, too
static_assert(std::atomic<int>::is_always_lock_free);

void remember(int signal) { received = signal; }

/// The second one of a kind ends the program at once.
void remember_first(int signal) {
  struct sigaction action = {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  ::sigaction(signal, &action, nullptr);
}

}  // namespace

void catch_signals() {
  static std::once_flag is_set;
  std::call_once(is_set, [] {
    remember_first(SIGINT);
    remember_first(SIGTERM);
  });
}

void take_file_limits_as_errors() { std::signal(SIGXFSZ, SIG_IGN); }

ExitCode signal_exit_code() {
  if (received == SIGINT) return kInterrupted;
  if (received == SIGTERM) return kTerminated;
  return kDone;
}

}  // namespace surfseg
