#include "tools/python/watched_work.h"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace surfseg::python {
namespace {

using Clock = std::chrono::steady_clock;

// Between two calls of a progress function after steps, and two looks for Ctrl-C.
constexpr std::chrono::milliseconds kPause(50);
// Between two calls with the same step.
constexpr std::chrono::milliseconds kBeat(100);

class WatchedWork {
 public:
  explicit WatchedWork(const py::object& progress) : progress_(progress) {}

  void run(const std::function<void(const Watch&, const std::stop_token&)>& work) {
    std::thread thread([&] {
      std::exception_ptr failure;
      try {
        work([this](const auto& stage, const auto& record) { return take(stage, record); },
             stop_.get_token());
      } catch (...) {
        failure = std::current_exception();
      }
      std::lock_guard lock(mutex_);
      failure_ = failure;
      is_done_ = true;
      changed_.notify_all();
    });
    {
      py::gil_scoped_release released;
      watch();
      thread.join();
    }
    if (raised_) std::rethrow_exception(raised_);
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  /// On the work's thread: waits for the answer, but where one was asked for a moment ago.
  bool take(const std::string& stage, const surf::flow::StepRecord& record) {
    std::unique_lock lock(mutex_);
    stage_ = stage;
    record_ = record;
    if (Clock::now() - last_call_ < kPause) return !stop_.stop_requested();
    is_asking_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return !is_asking_; });
    return !stop_.stop_requested();
  }

  /// On the caller's thread, until the work is done.
  void watch() {
    std::unique_lock lock(mutex_);
    while (!is_done_) {
      changed_.wait_for(lock, kPause, [&] { return is_done_ || is_asking_; });
      if (is_done_) break;
      const bool is_due = is_asking_ || Clock::now() - last_call_ >= kBeat;
      const auto stage = stage_;
      const auto record = record_;
      lock.unlock();
      const bool goes_on = stop_.stop_requested() || ask(stage, record, is_due);
      lock.lock();
      if (is_due) last_call_ = Clock::now();
      if (!goes_on) stop_.request_stop();
      is_asking_ = false;
      changed_.notify_all();
    }
  }

  /// Whether to go on.
  bool ask(const std::string& stage, const surf::flow::StepRecord& record, bool is_due) {
    py::gil_scoped_acquire held;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress_.is_none() || !is_due) return true;
      const std::chrono::duration<double> seconds = Clock::now() - begin_;
      const py::object answer = progress_(stage, record.k, record.n_elements, record.enclosed,
                                          record.energy, seconds.count());
      return answer.is_none() || answer.cast<bool>();
    } catch (...) {
      raised_ = std::current_exception();
      return false;
    }
  }

  const py::object& progress_;
  std::stop_source stop_;
  std::exception_ptr raised_;
  const Clock::time_point begin_ = Clock::now();
  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::string stage_ = "begin";
  surf::flow::StepRecord record_ = {};
  Clock::time_point last_call_ = begin_ - kPause;
  bool is_asking_ = false, is_done_ = false;
  std::exception_ptr failure_;
};

}  // namespace

void do_watched(const py::object& progress,
                const std::function<void(const Watch&, const std::stop_token&)>& work) {
  WatchedWork(progress).run(work);
}

}  // namespace surfseg::python
