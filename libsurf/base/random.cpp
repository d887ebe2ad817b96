#include "libsurf/base/random.h"

#include <cmath>
#include <numbers>

namespace surf {
namespace {

constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2^64 over the golden ratio

/// The finaliser of SplitMix64: a bijection whose output bits all depend on all input bits.
std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

double uniform_random(std::uint64_t start, std::uint64_t counter) {
  return (static_cast<double>(mix(start + kGolden * counter) >> 11) + 0.5) * 0x1p-53;
}

double normal_random(std::uint64_t seed, std::uint64_t counter) {
  const std::uint64_t start = mix(seed + kGolden);
  const double radius = std::sqrt(-2 * std::log(uniform_random(start, 2 * counter)));
  return radius * std::cos(2 * std::numbers::pi * uniform_random(start, 2 * counter + 1));
}

}  // namespace surf
