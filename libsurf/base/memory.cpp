#include "libsurf/base/memory.h"

#include <unistd.h>

namespace surf {

double machine_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

bool fits_in_memory(double n_values) { return 4 * n_values <= 0.8 * machine_memory(); }

}  // namespace surf
