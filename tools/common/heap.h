// How the programs get memory from the system. Where the C library is not GNU's nothing is done.
#pragma once

namespace surfseg {

/// From here on what is freed is kept for what comes next, in large pages where the system has
/// them: fresh memory costs a fault and a page of zeros each time, a tenth to a fifth of a run
/// (docs/performance.md). One heap serves four threads. Under a limit on memory (ulimit -v, -d,
/// --memory) pages are as they are. For a program, before its first thread.
void keep_freed_memory();

/// What is free now goes back to the system: after a limit was set, or while a program waits.
void give_freed_memory_back();

}  // namespace surfseg
