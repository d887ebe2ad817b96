// For maxflow::Graph, which else ends the process where it gets no memory.
#pragma once

#include <new>

namespace surf::segment {

/// @throws std::bad_alloc  the only failure of the calls that are made here
[[noreturn]] inline void throw_out_of_memory(const char*) { throw std::bad_alloc(); }

}  // namespace surf::segment
