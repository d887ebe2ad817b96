#include "libsurf/base/threads.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

namespace surf {

struct ThreadLimit::Impl {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int n_threads)
    : impl_(new Impl{tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                         std::size_t(n_threads))}) {}

ThreadLimit::~ThreadLimit() = default;

bool is_on_one_thread() {
  return tbb::this_task_arena::max_concurrency() == 1 ||
         tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) == 1;
}

}  // namespace surf
