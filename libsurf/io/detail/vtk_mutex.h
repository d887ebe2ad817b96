// VTK makes its objects by factories that all threads share: one thread at a time.
#pragma once

#include <mutex>

namespace surf::io::detail {

inline std::mutex& vtk_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace surf::io::detail
