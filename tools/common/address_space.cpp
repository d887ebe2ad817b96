// A limit on addresses below what the libraries need, told before their initialisers run: one of
// them (log4cplus, which OpenVDB links) starts threads in its own and ends the process where it
// cannot.
#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <initializer_list>

#include "tools/common/exit_codes.h"

namespace surfseg {
namespace {

// Their code and data, the stacks of their threads, and a little to work in: 256 MB are too few, as
// measured.
constexpr rlim_t kLeastBytes = rlim_t(264) << 20;

/// Runs before any initialiser, with the C library alone.
void check_address_space(int, char** argv, char**) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur >= kLeastBytes) return;
  const char* slash = std::strrchr(argv[0], '/');
  for (const char* part : {slash ? slash + 1 : argv[0],
                           ": error: the limit on addresses (ulimit -v) is below the 264 MB that "
                           "the libraries need\n"})
    if (::write(STDERR_FILENO, part, std::strlen(part)) < 0) break;
  ::_exit(kInput);
}

[[gnu::used, gnu::section(".preinit_array")]] void (*const check)(int, char**,
                                                                  char**) = check_address_space;

}  // namespace
}  // namespace surfseg
