#include "tools/common/signals.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>

namespace surfseg {
namespace {

constexpr std::chrono::milliseconds kPause(20);  // between two looks

std::atomic<int> received = 0;  // read by the studio's threads, too
static_assert(std::atomic<int>::is_always_lock_free);

/// The second one of a kind ends the program at once, but for SIGXCPU, which comes again with each
/// second beyond the limit.
void remember(int signal) {
  const int error = errno;  // of what was interrupted
  received = signal;
  if (signal != SIGXCPU) std::signal(signal, SIG_DFL);
  errno = error;
}

}  // namespace

void catch_signals() {
  static std::once_flag is_set;
  std::call_once(is_set, [] {
    std::signal(SIGINT, remember);
    std::signal(SIGTERM, remember);
    std::signal(SIGXCPU, remember);
  });
}

void take_file_limits_as_errors() { std::signal(SIGXFSZ, SIG_IGN); }

ExitCode signal_exit_code() {
  if (received == SIGINT) return kInterrupted;
  if (received == SIGTERM) return kTerminated;
  if (received == SIGXCPU) return kCpuLimit;
  return kDone;
}

SignalStop::SignalStop()
    : watch_([stop = stop_](const std::stop_token& end) mutable {
        std::mutex mutex;
        std::condition_variable_any ended;
        std::unique_lock lock(mutex);
        while (signal_exit_code() == kDone)
          if (ended.wait_for(lock, end, kPause, [&] { return end.stop_requested(); })) return;
        stop.request_stop();
      }) {}

}  // namespace surfseg
