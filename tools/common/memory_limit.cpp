#include "tools/common/memory_limit.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <charconv>

#include "libsurf/base/error.h"
#include "tools/common/heap.h"

namespace surfseg {
namespace {

constexpr std::size_t kKept = std::size_t(1) << 30;  // of fields, without a limit
constexpr double kLeast = 200e6;  // libraries, stacks of threads: a ball of 32^3 takes 150 MB
constexpr double kShareKept = 0.25;

double bytes_of(const std::string& text) {
  double value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, status] = std::from_chars(text.data(), last, value);
  const std::string unit(end, last);
  const double scale = unit == "GB" ? 1e9 : unit == "MB" ? 1e6 : 0;
  if (status != std::errc() || scale == 0 || !(value > 0 && value < 1e9))
    throw surf::UsageError(fmt::format(
        "--memory: expected a size with its unit, such as 2GB or 800MB; got '{}'", text));
  return value * scale;
}

}  // namespace

std::size_t limit_memory(const std::string& text) {
  if (text.empty()) return kKept;
  const double n_bytes = bytes_of(text);
  if (n_bytes < kLeast)
    throw surf::UsageError(
        fmt::format("--memory: {} is less than the 200MB that the program itself needs", text));
  rlimit limit{};
  ::getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(n_bytes));
  ::setrlimit(RLIMIT_DATA, &limit);
  give_freed_memory_back();  // the limit counts it
  return std::min(kKept, static_cast<std::size_t>(kShareKept * n_bytes));
}

}  // namespace surfseg
