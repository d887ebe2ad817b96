// What work has used of the machine.
#pragma once

#include <chrono>

namespace surf {

struct Resources {
  double seconds = 0;         ///< wall time
  double cpu_seconds = 0;     ///< of all threads of the process
  double peak_memory_mb = 0;  ///< largest resident set of the process so far [2^20 bytes]
};

/// Measures from when it was made.
class ResourceMeter {
 public:
  ResourceMeter();
  Resources used() const;

 private:
  std::chrono::steady_clock::time_point begin_;
  double cpu_begin_;
};

}  // namespace surf
