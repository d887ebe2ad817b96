// libFuzzer's entry to one target, SURFSEG_FUZZ_TARGET.
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t n_bytes) {
  static const surf::fuzz::Target& target = surf::fuzz::target(SURFSEG_FUZZ_TARGET);
  try {
    surf::fuzz::run(target, {data, n_bytes});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", target.name, error.what());
    std::abort();
  }
  return 0;
}
