// Time and peak memory of a program's stages, for the summary.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

namespace surfseg {

double seconds_since(std::chrono::steady_clock::time_point start);
double peak_memory_mb();

class StageClock {
 public:
  void begin(const std::string& name);
  void end();
  const nlohmann::ordered_json& stages() const { return stages_; }
  /// Since the clock was made.
  double total_seconds() const { return seconds_since(made_); }

 private:
  std::string name_;
  std::chrono::steady_clock::time_point made_ = std::chrono::steady_clock::now(), start_;
  nlohmann::ordered_json stages_ = nlohmann::ordered_json::object();
};

}  // namespace surfseg
