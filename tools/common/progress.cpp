#include "tools/common/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "tools/common/say.h"

namespace surfseg {

ProgressLine::ProgressLine(Verbosity verbosity)
    : verbosity_(verbosity), is_terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (has_line_) say("\r\x1b[K");
  has_line_ = false;
}

void ProgressLine::step(const std::string& line) {
  if (verbosity_ == Verbosity::kQuiet) return;
  if (verbosity_ == Verbosity::kVerbose) {
    say("{}\n", line);
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < std::chrono::milliseconds(is_terminal_ ? 100 : 2000)) return;
  last_ = now;
  if (is_terminal_) {
    say("\r{}\x1b[K", line);
    std::fflush(stderr);
    has_line_ = true;
  } else {
    say("{}\n", line);
  }
}

void ProgressLine::note(const std::string& line) {
  if (verbosity_ != Verbosity::kQuiet) failure(line);
}

void ProgressLine::failure(const std::string& line) {
  clear();
  say("{}\n", line);
}

}  // namespace surfseg
