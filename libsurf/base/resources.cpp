#include "libsurf/base/resources.h"

#include <sys/resource.h>

namespace surf {
namespace {

rusage usage_of_process() {
  rusage out{};
  ::getrusage(RUSAGE_SELF, &out);
  return out;
}

double cpu_seconds(const rusage& usage) {
  const auto seconds = [](const timeval& time) {
    return double(time.tv_sec) + 1e-6 * double(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

ResourceMeter::ResourceMeter()
    : begin_(std::chrono::steady_clock::now()), cpu_begin_(cpu_seconds(usage_of_process())) {}

Resources ResourceMeter::used() const {
  const rusage usage = usage_of_process();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(),
          cpu_seconds(usage) - cpu_begin_, double(usage.ru_maxrss) / 1024};
}

}  // namespace surf
