// How much of the heap is in use, and the most there was.
#pragma once

#include <cstddef>

namespace surf::fuzz {

/// Counts from its construction on, in all threads; one at a time.
class AllocationMeter {
 public:
  AllocationMeter();
  /// Bytes in use beyond those of the beginning, at most.
  std::size_t peak() const;
};

}  // namespace surf::fuzz
