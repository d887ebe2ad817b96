// Keeps OpenBLAS to the thread that calls it.
#pragma once

#include <mutex>

namespace surf {

/// Keeps CHOLMOD and OpenBLAS under it to this thread, for as long as it is there. CHOLMOD's OpenMP
/// teams of four wait for each other at thousands of small supernodes: with another process on the
/// cores locating the edges of a spleen took 3.1 s of wall time for 0.6 s of work, 1.7 so.
/// OpenBLAS' own threads made it 1.9 s for the inside of a skull, not 1.3. Where it was built
/// without any (libopenblas0-serial) two threads in it spoil each other's factors, so that one
/// waits. Throws std::bad_alloc where a limit on memory leaves no room for OpenBLAS.
class OneBlasThread {
 public:
  OneBlasThread();
  ~OneBlasThread();
  OneBlasThread(const OneBlasThread&) = delete;
  OneBlasThread& operator=(const OneBlasThread&) = delete;

 private:
  int levels_, omp_threads_;
  std::unique_lock<std::mutex> alone_;
};

}  // namespace surf
