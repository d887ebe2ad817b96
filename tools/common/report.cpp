#include "tools/common/report.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"

namespace surfseg {

void write_json(const std::string& path, const nlohmann::ordered_json& document) {
  surf::write_bytes(
      path, document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

void KeyValues::add(const std::string& key, const std::string& value) {
  text_ += fmt::format("{:<{}} {}\n", key, width_, value);
}

nlohmann::ordered_json read_json(const std::string& path) {
  std::ifstream stream(path);
  if (!stream)
    throw surf::InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  try {
    return nlohmann::ordered_json::parse(stream);
  } catch (const nlohmann::json::exception& error) {
    throw surf::InputError(fmt::format("{}: not valid JSON: {}", path, error.what()));
  }
}

}  // namespace surfseg
