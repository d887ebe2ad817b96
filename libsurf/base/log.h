// The library's one logger. It prints nothing by itself; programs replace the sink.
#pragma once

#include <functional>
#include <string>

namespace surf {

enum class LogLevel { kDebug, kInfo, kWarning };

using LogSink = std::function<void(LogLevel, const std::string&)>;

/// Replaces the sink that receives every message (none by default); thread-safe.
void set_log_sink(LogSink sink);

/// Sends one line, without a line end, to the sink.
void log(LogLevel level, const std::string& message);

}  // namespace surf
