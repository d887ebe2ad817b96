#include "tests/fuzz/allocations.h"

#include <malloc.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

#if defined(__has_feature)
#define SURFSEG_HAS_FEATURE(name) __has_feature(name)
#else
#define SURFSEG_HAS_FEATURE(name) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    SURFSEG_HAS_FEATURE(address_sanitizer) || SURFSEG_HAS_FEATURE(thread_sanitizer)
#define SURFSEG_IS_SANITIZED 1
#include <sanitizer/allocator_interface.h>
#else
#define SURFSEG_IS_SANITIZED 0
#endif

namespace {

std::atomic<std::int64_t> in_use{0}, most{0};

void add(std::size_t n_bytes) {
  const std::int64_t now = in_use += std::int64_t(n_bytes);
  for (std::int64_t before = most; before < now && !most.compare_exchange_weak(before, now);) {
  }
}

void subtract(std::size_t n_bytes) { in_use -= std::int64_t(n_bytes); }

}  // namespace

#if SURFSEG_IS_SANITIZED
namespace {

void on_malloc(const volatile void*, std::size_t n_bytes) { add(n_bytes); }
void on_free(const volatile void* pointer) {
  if (pointer) subtract(__sanitizer_get_allocated_size(const_cast<const void*>(pointer)));
}
[[maybe_unused]] const int is_installed =
    __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);

}  // namespace
#else
// The C library's own functions under the names that it keeps for such wrappers.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t n_bytes) {
  void* out = __libc_malloc(n_bytes);
  if (out) add(malloc_usable_size(out));
  return out;
}
void* calloc(std::size_t n, std::size_t n_bytes) {
  void* out = __libc_calloc(n, n_bytes);
  if (out) add(malloc_usable_size(out));
  return out;
}
void* realloc(void* pointer, std::size_t n_bytes) {
  const std::size_t n_before = pointer ? malloc_usable_size(pointer) : 0;
  void* out = __libc_realloc(pointer, n_bytes);
  if (out || n_bytes == 0) subtract(n_before);
  if (out) add(malloc_usable_size(out));
  return out;
}
void* memalign(std::size_t alignment, std::size_t n_bytes) {
  void* out = __libc_memalign(alignment, n_bytes);
  if (out) add(malloc_usable_size(out));
  return out;
}
void* aligned_alloc(std::size_t alignment, std::size_t n_bytes) {
  return memalign(alignment, n_bytes);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t n_bytes) {
  *out = memalign(alignment, n_bytes);
  return *out ? 0 : 12;  // ENOMEM
}
void free(void* pointer) {
  if (pointer) subtract(malloc_usable_size(pointer));
  __libc_free(pointer);
}
}
#endif

namespace surf::fuzz {
namespace {

std::int64_t at_begin = 0;

}  // namespace

AllocationMeter::AllocationMeter() { most = at_begin = in_use; }

std::size_t AllocationMeter::peak() const { return std::size_t(most - at_begin); }

}  // namespace surf::fuzz
