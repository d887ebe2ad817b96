#include "libsurf/base/detail/one_blas_thread.h"

#include <cblas-openblas.h>
#include <omp.h>
#include <sys/mman.h>

#include <algorithm>
#include <condition_variable>
#include <limits>
#include <new>
#include <thread>
#include <vector>

#include "libsurf/base/memory.h"

// OpenBLAS' own, which its headers do not name.
extern "C" {
[[gnu::weak]] void* blas_memory_alloc(int position);
[[gnu::weak]] void blas_memory_free(void* buffer);
}

namespace surf {
namespace {

constexpr int kSerial = 0;  // as openblas_get_parallel() says

std::mutex one_at_a_time, counting;
std::condition_variable one_has_left;
int n_callers = 0, threads_before = 1;

/// How many may be in OpenBLAS at once. Each caller takes a buffer of 128 MB, most of which is
/// never touched, and where a limit on memory leaves none OpenBLAS asks for it again and again,
/// without end. So under a limit those that can be had are taken before the first call; OpenBLAS
/// keeps them for later ones.
int most_callers() {
  constexpr std::size_t kBuffer = std::size_t(128) << 20, kRest = std::size_t(64) << 20;
  static const int n = [] {
    if (usable_memory() >= machine_memory() || !blas_memory_alloc || !blas_memory_free)
      return std::numeric_limits<int>::max();
    std::vector<void*> buffers;
    while (buffers.size() < std::max(1u, std::thread::hardware_concurrency())) {
      void* const room = ::mmap(nullptr, kBuffer + kRest, PROT_READ | PROT_WRITE,
                                MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (room == MAP_FAILED) break;
      ::munmap(room, kBuffer + kRest);
      buffers.push_back(blas_memory_alloc(0));
    }
    for (void* const buffer : buffers) blas_memory_free(buffer);
    return int(buffers.size());
  }();
  return n;
}

}  // namespace

OneBlasThread::OneBlasThread()
    : levels_(omp_get_max_active_levels()), omp_threads_(omp_get_max_threads()) {
  const int most = most_callers();
  if (most == 0) throw std::bad_alloc();
  omp_set_max_active_levels(0);
  omp_set_num_threads(1);  // of this thread: libopenblas0-openmp parts its work by it
  if (openblas_get_parallel() == kSerial) {
    alone_ = std::unique_lock(one_at_a_time);
    return;
  }
  std::unique_lock lock(counting);
  one_has_left.wait(lock, [most] { return n_callers < most; });
  if (n_callers++ > 0) return;
  threads_before = openblas_get_num_threads();
  if (threads_before != 1) openblas_set_num_threads(1);
}

OneBlasThread::~OneBlasThread() {
  omp_set_max_active_levels(levels_);
  omp_set_num_threads(omp_threads_);
  if (alone_.owns_lock()) return;
  const std::lock_guard lock(counting);
  one_has_left.notify_one();
  if (--n_callers == 0 && threads_before != 1) openblas_set_num_threads(threads_before);
}

}  // namespace surf
