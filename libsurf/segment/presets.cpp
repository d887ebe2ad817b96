#include "libsurf/segment/presets.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "libsurf/base/error.h"
#include "libsurf/base/nearest_name.h"

namespace surf::segment {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = "share/surfseg/presets";

/// The file that this code is in: the library, or a program that it is linked into.
fs::path own_file() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&preset_folders), &info) == 0 || !info.dli_fname)
    return {};
  return info.dli_fname;
}

/// Beside the folder that the file is in, or one above: lib/, lib/x86_64-linux-gnu/, bin/.
std::optional<std::string> folder_beside(const fs::path& file) {
  std::error_code status;
  fs::path folder = fs::canonical(file, status).parent_path();
  for (int n = 0; n < 2 && folder.has_relative_path(); ++n) {
    folder = folder.parent_path();
    if (fs::is_directory(folder / kFolder, status)) return (folder / kFolder).string();
  }
  return std::nullopt;
}

Preset read_preset(const fs::path& path) {
  std::ifstream stream(path);
  nlohmann::json document;
  try {
    document = nlohmann::json::parse(stream);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: not valid JSON: {}", path.string(), error.what()));
  }
  if (!document.is_object())
    throw InputError(fmt::format("{}: expected an object of options", path.string()));
  Preset out{path.stem().string(), {}, path.string()};
  if (const auto at = document.find("description"); at != document.end() && at->is_string())
    out.description = at->get<std::string>();
  return out;
}

}  // namespace

std::vector<std::string> preset_folders() {
  std::vector<std::string> out;
  if (const char* folders = std::getenv("SURFSEG_PRESETS")) {
    std::istringstream stream(folders);
    for (std::string folder; std::getline(stream, folder, ':');)
      if (!folder.empty()) out.push_back(folder);
  }
  std::optional<std::string> beside = folder_beside(own_file());
  if (!beside) beside = folder_beside("/proc/self/exe");
  if (beside) out.push_back(*beside);
  return out;
}

std::vector<Preset> presets() {
  std::map<std::string, Preset> by_name;
  for (const std::string& folder : preset_folders()) {
    std::error_code status;
    for (fs::directory_iterator at(folder, status), end; at != end; at.increment(status))
      if (at->path().extension() == ".json")
        by_name.try_emplace(at->path().stem().string(), read_preset(at->path()));
  }
  std::vector<Preset> out;
  for (auto& [name, preset] : by_name) out.push_back(std::move(preset));
  return out;
}

Preset find_preset(const std::string& name) {
  std::vector<std::string> names;
  for (const Preset& preset : presets()) {
    if (preset.name == name) return preset;
    names.push_back(preset.name);
  }
  if (names.empty())
    throw UsageError(fmt::format(
        "preset '{}' is unknown: there are none; SURFSEG_PRESETS names folders of them", name));
  const std::string near = did_you_mean(name, names);
  throw UsageError(fmt::format("preset '{}' is unknown{} {}", name,
                               near.empty() ? "; there are" : near + " There are",
                               fmt::join(names, ", ")));
}

}  // namespace surf::segment
