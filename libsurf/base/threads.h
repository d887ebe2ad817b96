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

}  // namespace surf
