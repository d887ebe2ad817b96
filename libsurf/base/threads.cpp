#include "libsurf/base/threads.h"

#include <tbb/global_control.h>

namespace surf {

struct ThreadLimit::Impl {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int n_threads)
    : impl_(new Impl{tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                         std::size_t(n_threads))}) {}

ThreadLimit::~ThreadLimit() = default;

}  // namespace surf
