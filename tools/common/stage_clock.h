// Time and memory of a program's stages, for the summary and the profile.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libsurf/base/resources.h"

namespace surfseg {

double seconds_since(std::chrono::steady_clock::time_point start);
double peak_memory_mb();

class StageClock {
 public:
  void begin(const std::string& name);
  void end();
  /// In the order in which they were begun.
  const std::vector<std::pair<std::string, surf::Resources>>& stages() const { return stages_; }
  nlohmann::ordered_json to_json() const;
  /// Since the clock was made.
  surf::Resources total() const { return all_.used(); }
  double total_seconds() const { return total().seconds; }

 private:
  std::string name_;
  surf::ResourceMeter all_;
  std::optional<surf::ResourceMeter> stage_;
  std::vector<std::pair<std::string, surf::Resources>> stages_;
};

}  // namespace surfseg
