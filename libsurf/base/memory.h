// How much memory there is.
#pragma once

#include <string>

namespace surf {

/// The machine's memory [bytes].
double machine_memory();
/// That, or less if the process is limited (ulimit -v, ulimit -d, --memory of the programs).
double usable_memory();
/// "this machine has 23.5 GiB", "2.0 GiB are allowed".
std::string usable_memory_text();

/// Whether so much can be held: at most 80 % of the usable memory.
bool fits_in_memory(double n_bytes);

/// Whether a file of `n_stored` bytes may honestly declare `n_declared` bytes of content: no more
/// than 1032 times as many, as deflate makes at most, and 4 MiB for formats that shrink what is
/// constant further. Asked before anything is allocated.
bool is_borne_out(double n_declared, double n_stored);

}  // namespace surf
