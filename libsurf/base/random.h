// Random numbers that are functions of a seed and a counter: the same in any order, with any number
// of threads and, unlike the standard's distributions, with any standard library.
#pragma once

#include <cstdint>

namespace surf {

/// The number `counter` of a uniform sequence in (0, 1).
double uniform_random(std::uint64_t start, std::uint64_t counter);

/// The number `counter` of a sequence with the standard normal distribution (Box and Muller's
/// transform).
double normal_random(std::uint64_t seed, std::uint64_t counter);

}  // namespace surf
