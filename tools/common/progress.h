// The progress of a run on stderr: one line that is rewritten on a terminal, plain lines in a pipe.
#pragma once

#include <chrono>
#include <string>

namespace surfseg {

enum class Verbosity { kQuiet, kNormal, kVerbose };

class ProgressLine {
 public:
  explicit ProgressLine(Verbosity verbosity);
  ~ProgressLine();

  /// One step; on a terminal at most ten lines a second, in a pipe one in two seconds, all
  /// when verbose.
  void step(const std::string& line);
  /// A line that is always kept unless quiet.
  void note(const std::string& line);
  /// A line that is always kept.
  void failure(const std::string& line);

 private:
  void clear();

  Verbosity verbosity_;
  bool is_terminal_;
  bool has_line_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace surfseg
