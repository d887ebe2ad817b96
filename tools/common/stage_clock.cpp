#include "tools/common/stage_clock.h"

#include <cmath>

namespace surfseg {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double peak_memory_mb() { return surf::ResourceMeter().used().peak_memory_mb; }

void StageClock::begin(const std::string& name) {
  end();
  name_ = name;
  stage_.emplace();
}

void StageClock::end() {
  if (stage_) stages_.emplace_back(name_, stage_->used());
  stage_.reset();
}

nlohmann::ordered_json StageClock::to_json() const {
  const auto milli = [](double seconds) { return std::round(1000 * seconds) / 1000; };
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (const auto& [name, used] : stages_)
    out[name] = {{"time_s", milli(used.seconds)},
                 {"cpu_s", milli(used.cpu_seconds)},
                 {"peak_memory_mb", std::round(used.peak_memory_mb)}};
  return out;
}

}  // namespace surfseg
