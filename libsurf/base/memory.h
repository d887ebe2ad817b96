// How much memory there is.
#pragma once

#include <cstddef>

namespace surf {

/// The machine's memory [bytes].
double machine_memory();

/// Whether `n_values` 32-bit floats can be held: they need at most 80 % of the machine's memory.
bool fits_in_memory(double n_values);

}  // namespace surf
