#include "tools/common/heap.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <thread>

namespace surfseg {

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

constexpr std::size_t kInLargePages = std::size_t(1) << 30;  // of the heap; more is in small ones
constexpr std::size_t kLargePage = std::size_t(2) << 20;
constexpr unsigned kThreadsPerHeap = 4;  // not measured with more than two cores
constexpr int kNever = std::numeric_limits<int>::max();

bool is_limited() {
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur != RLIM_INFINITY) return true;
  }
  return false;
}

/// The heap grown to so much, which costs nothing until it is used, and asked to be in large pages.
void ask_for_large_pages() {
  void* const block = std::malloc(kInLargePages);
  if (!block) return;
  const auto address = reinterpret_cast<std::uintptr_t>(block),
             first = (address + kLargePage - 1) / kLargePage * kLargePage,
             end = (address + kInLargePages) / kLargePage * kLargePage;
  ::madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
  std::free(block);
}

}  // namespace

void keep_freed_memory() {
  const unsigned n_threads = std::max(1u, std::thread::hardware_concurrency());
  ::mallopt(M_ARENA_MAX, int((n_threads + kThreadsPerHeap - 1) / kThreadsPerHeap));
  ::mallopt(M_MMAP_THRESHOLD, kNever);
  ::mallopt(M_TRIM_THRESHOLD, kNever);
  if (!is_limited()) ask_for_large_pages();
}

void give_freed_memory_back() {
  ::malloc_trim(0);
  if (!is_limited()) ask_for_large_pages();  // what comes next begins where the heap was cut
}

#else

void keep_freed_memory() {}
void give_freed_memory_back() {}

#endif

}  // namespace surfseg
