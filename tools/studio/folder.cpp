#include "tools/studio/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <sstream>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/recipe.h"

namespace surfseg::studio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostEntries = 2000;
constexpr int kMostLooked = 20;  // files of a folder that may be DICOM's
constexpr std::array kVolumes = {".nii",  ".nii.gz", ".hdr", ".mha", ".mhd",
                                 ".nrrd", ".nhdr",   ".vti", ".vdb", ".dcm"};

std::string first_bytes(const fs::path& path, std::size_t n) {
  std::ifstream in(path, std::ios::binary);
  std::string out(n, '\0');
  in.read(out.data(), std::streamsize(n));
  out.resize(std::size_t(std::max<std::streamsize>(in.gcount(), 0)));
  return out;
}

bool is_dicom(const fs::path& path) {
  return first_bytes(path, 132).substr(0, 132).ends_with("DICM");
}

}  // namespace

bool is_dicom_folder(const fs::path& folder) {
  std::error_code error;
  int n_looked = 0;
  for (fs::directory_iterator it(folder, error), end; it != end; it.increment(error)) {
    if (!it->is_regular_file(error)) continue;
    if (is_dicom(it->path())) return true;
    if (++n_looked == kMostLooked) break;
  }
  return false;
}

bool is_recipe(const fs::path& path) {
  return surf::extension(path.string()) == ".json" &&
         first_bytes(path, 400).find("surfseg recipe") != std::string::npos;
}

std::vector<FolderEntry> entries_of(const fs::path& folder) {
  std::vector<FolderEntry> out;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; it != end; it.increment(error)) {
    const fs::directory_entry& entry = *it;
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || out.size() == kMostEntries) continue;
    if (entry.is_directory(error)) {
      if (is_dicom_folder(entry.path())) out.push_back({name, "DICOM folder", 0});
      continue;
    }
    if (!entry.is_regular_file(error)) continue;
    const std::string extension = surf::extension(name);
    if (std::find(kVolumes.begin(), kVolumes.end(), extension) != kVolumes.end())
      out.push_back({name, "volume", entry.file_size(error)});
    else if (is_recipe(entry.path()))
      out.push_back({name, "recipe", entry.file_size(error)});
  }
  std::sort(out.begin(), out.end(),
            [](const FolderEntry& a, const FolderEntry& b) { return a.name < b.name; });
  return out;
}

fs::path recipe_beside(const fs::path& folder, const fs::path& image,
                       const std::optional<std::string>& series_uid) {
  // Whatever a file's header has for a UID, it is part of a name and leads nowhere.
  std::string series = series_uid ? "." + *series_uid : "";
  std::replace_if(
      series.begin(), series.end(),
      [](unsigned char c) { return !(std::isalnum(c) || c == '.' || c == '-'); }, '_');
  return folder / (image.filename().string() + series + ".surfseg.json");
}

RecipeImage image_of_recipe(const fs::path& recipe) {
  std::ifstream in(recipe, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  const fs::path named = surf::segment::image_of_recipe(text.str());
  // A folder may be named with a slash at its end.
  const fs::path name = (named.has_filename() ? named : named.parent_path()).filename();
  const fs::path beside = recipe.parent_path() / name;
  if (name.empty() || name == "." || name == ".." || !fs::exists(beside))
    throw surf::InputError(fmt::format("{}: its volume '{}' is not beside it",
                                       recipe.filename().string(), name.string()));
  const std::string series = surf::segment::series_of_recipe(text.str());
  return {beside, series.empty() ? std::nullopt : std::optional(series)};
}

bool leads_out(const fs::path& folder, const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return false;
  const fs::path end = fs::weakly_canonical(surf::end_of_links(path.string()), error);
  const fs::path within = end.lexically_relative(fs::weakly_canonical(folder, error));
  return within.empty() || *within.begin() == "..";
}

constexpr std::size_t kLongestName = 200;

fs::path output_path(const fs::path& folder, const std::string& name) {
  const bool is_plain =
      !name.empty() && name.front() != '.' && fs::path(name).filename() == fs::path(name) &&
      name.find('/') == std::string::npos && name.find('\\') == std::string::npos &&
      std::none_of(name.begin(), name.end(),
                   [](char c) { return (unsigned char)c < 32 || c == 127; });
  if (name.size() > kLongestName)
    throw surf::UsageError(fmt::format("'{}...': a name of {} bytes; at most {} are taken",
                                       name.substr(0, 40), name.size(), kLongestName));
  if (!is_plain)
    throw surf::UsageError(fmt::format(
        "'{}': expected the name of a file, without a folder and not hidden", name.substr(0, 80)));
  fs::path out = folder / name;
  std::error_code error;
  const fs::file_status status = fs::symlink_status(out, error);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw surf::UsageError(fmt::format("'{}' is no plain file: choose another name", name));
  return out;
}

}  // namespace surfseg::studio
