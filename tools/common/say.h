// Lines on standard error.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "libsurf/base/no_pipe_signal.h"

namespace surfseg {

/// What cannot be written there, on a full disk, a closed terminal or a pipe that nobody reads, is
/// lost: no work ends for it.
template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  const surf::NoPipeSignal no_signal;
  std::fwrite(text.data(), 1, text.size(), stderr);
}

}  // namespace surfseg
