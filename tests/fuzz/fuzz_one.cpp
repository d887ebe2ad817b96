// libFuzzer's entry to one target, SURFSEG_FUZZ_TARGET. At the end it adds the most memory that a
// reading took to libFuzzer's own numbers.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "tests/fuzz/targets.h"

namespace {

/// Smaller files would tell of fixed buffers alone.
constexpr std::size_t kLeastBytes = 64;

struct MostMemory {
  std::size_t n_bytes = 0;  ///< of the heap
  double per_byte = 0;      ///< of the file, beyond what an empty one takes
  ~MostMemory() {
    std::fprintf(stderr, "stat::most_heap_kb: %zu\nstat::most_heap_per_byte: %.0f\n", n_bytes >> 10,
                 per_byte);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t n_bytes) {
  static const surf::fuzz::Target& target = surf::fuzz::target(SURFSEG_FUZZ_TARGET);
  static MostMemory most;
  try {
    static const std::size_t of_none = surf::fuzz::run(target, {}).peak_bytes;
    const std::size_t peak = surf::fuzz::run(target, {data, n_bytes}).peak_bytes;
    most.n_bytes = std::max(most.n_bytes, peak);
    if (n_bytes >= kLeastBytes && peak > of_none)
      most.per_byte = std::max(most.per_byte, double(peak - of_none) / double(n_bytes));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", target.name, error.what());
    std::abort();
  }
  return 0;
}
