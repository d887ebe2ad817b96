#include "tools/batch/batch_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>

#include "libsurf/base/log.h"
#include "libsurf/base/threads.h"
#include "tools/batch/run_case.h"
#include "tools/common/field_names.h"
#include "tools/common/heap.h"
#include "tools/common/signals.h"
#include "tools/common/stage_clock.h"

namespace surfseg::batch {
namespace {

using Clock = std::chrono::steady_clock;

/// "1:05", "2:01:05"
std::string duration(double seconds) {
  const long s = std::lround(seconds);
  if (s < 3600) return fmt::format("{}:{:02}", s / 60, s % 60);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

/// What is told while cases run. Thread-safe.
class Board {
 public:
  Board(std::size_t n_cases, Verbosity verbosity)
      : n_cases_(int(n_cases)),
        is_terminal_(::isatty(STDERR_FILENO) == 1 && verbosity == Verbosity::kNormal),
        line_(verbosity) {
    surf::set_log_sink([this](surf::LogLevel level, const std::string& message) {
      if (level != surf::LogLevel::kWarning) return;
      const std::scoped_lock lock(mutex_);
      line_.note("warning: " + with_option_names(message, "surfseg"));
    });
  }
  ~Board() { surf::set_log_sink({}); }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  void begin() {
    const std::scoped_lock lock(mutex_);
    show();
  }

  /// A case has ended, and was not interrupted.
  void add(const Case& row, const CaseOutcome& outcome, double seconds) {
    const std::scoped_lock lock(mutex_);
    ++(outcome.is_skipped              ? counts_.n_skipped
       : is_success(outcome.exit_code) ? counts_.n_done
                                       : counts_.n_failed);
    if (!is_success(outcome.exit_code))
      line_.failure(fmt::format("{}{}: failed ({}): {}", place(), row.name, int(outcome.exit_code),
                                outcome.message));
    else if (!is_terminal_)
      line_.note(fmt::format("{}{}: {}", place(), row.name,
                             outcome.is_skipped ? "is done already, skipped"
                             : outcome.exit_code == kStoppedAtLimit
                                 ? fmt::format("stopped at a limit, {:.1f} s", seconds)
                                 : fmt::format("done, {:.1f} s", seconds)));
    show();
  }

  RunCounts counts() const { return counts_; }

 private:
  int n_ended() const { return counts_.n_done + counts_.n_skipped + counts_.n_failed; }
  std::string place() const {
    return is_terminal_ ? "" : fmt::format("[{}/{}] ", n_ended(), n_cases_);
  }

  /// From the cases that were run: those that are skipped take no time.
  std::string time_left() const {
    const int n_run = counts_.n_done + counts_.n_failed;
    if (n_run == 0 || n_ended() == n_cases_) return "";
    return fmt::format(", {} left",
                       duration(seconds_since(start_) / n_run * double(n_cases_ - n_ended())));
  }

  void show() {
    if (!is_terminal_ || n_cases_ == 0) return;  // a part of a list may have none
    constexpr int kWidth = 24;
    const int n_full = kWidth * n_ended() / n_cases_;
    line_.step(fmt::format(
        "[{}{}] {}/{}{}{}{}", std::string(std::size_t(n_full), '#'),
        std::string(std::size_t(kWidth - n_full), '.'), n_ended(), n_cases_,
        counts_.n_failed > 0 ? fmt::format(", {} failed", counts_.n_failed) : "",
        counts_.n_skipped > 0 ? fmt::format(", {} skipped", counts_.n_skipped) : "", time_left()));
  }

  const int n_cases_;
  const bool is_terminal_;
  ProgressLine line_;
  std::mutex mutex_;
  RunCounts counts_;
  Clock::time_point start_ = Clock::now();
};

void run_next(const std::vector<Case>& cases, const RunOptions& options, std::atomic_size_t& next,
              Board& board) {
  while (signal_exit_code() == kDone) {
    const std::size_t n = next++;
    if (n >= cases.size()) return;
    const Clock::time_point start = Clock::now();
    const CaseOutcome outcome = run_case(cases[n], options.folder);
    if (is_of_signal(outcome.exit_code)) return;
    board.add(cases[n], outcome, seconds_since(start));
    give_freed_memory_back();
  }
}

}  // namespace

RunCounts run_cases(const std::vector<Case>& cases, const RunOptions& options) {
  catch_signals();
  const int n_jobs = std::clamp(options.n_jobs, 1, std::max(1, int(cases.size()))),
            n_threads = options.n_threads > 0
                            ? options.n_threads
                            : std::max(1, int(std::thread::hardware_concurrency()));
  // Each job is a thread itself; the library's help them all.
  const surf::ThreadLimit limit(std::max(1, n_threads - n_jobs + 1));
  Board board(cases.size(), options.verbosity);
  board.begin();
  std::atomic_size_t next = 0;
  {
    std::vector<std::jthread> jobs;
    for (int job = 1; job < n_jobs; ++job)
      jobs.emplace_back([&] { run_next(cases, options, next, board); });
    run_next(cases, options, next, board);
  }
  return board.counts();
}

}  // namespace surfseg::batch
