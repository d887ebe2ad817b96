#include "tools/common/stage_clock.h"

#include <sys/resource.h>

#include <cmath>

namespace surfseg {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

void StageClock::begin(const std::string& name) {
  end();
  name_ = name;
  start_ = std::chrono::steady_clock::now();
}

void StageClock::end() {
  if (!name_.empty())
    stages_[name_] = {{"time_s", std::round(1000 * seconds_since(start_)) / 1000},
                      {"peak_memory_mb", std::round(peak_memory_mb())}};
  name_.clear();
}

}  // namespace surfseg
