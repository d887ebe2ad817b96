#include "libsurf/base/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

namespace surf {

double machine_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

double usable_memory() {
  double out = machine_memory();
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
      out = std::min(out, static_cast<double>(limit.rlim_cur));
  }
  return out;
}

std::string usable_memory_text() {
  const double usable = usable_memory();
  return usable < machine_memory() ? fmt::format("{:.1f} GiB are allowed", usable / (1 << 30))
                                   : fmt::format("this machine has {:.1f} GiB", usable / (1 << 30));
}

bool fits_in_memory(double n_bytes) { return n_bytes <= 0.8 * usable_memory(); }

bool is_borne_out(double n_declared, double n_stored) {
  constexpr double kLargestRatio = 1032, kFree = 4 << 20;
  return n_declared <= kLargestRatio * n_stored + kFree;
}

}  // namespace surf
