// How many threads the library uses. Results do not depend on it.
#pragma once

#include <memory>

namespace surf {

/// Limits the library's threads while it lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(int n_threads);
  ~ThreadLimit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether the caller has but one thread, for whom nothing is done ahead of its turn.
bool is_on_one_thread();

}  // namespace surf
