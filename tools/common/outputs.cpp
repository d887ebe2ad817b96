#include "tools/common/outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/option_group.h"

namespace surfseg {
namespace {

namespace fs = std::filesystem;

/// Permission bits do not tell for every user and file system: a file is made and removed.
void check_folder_takes_files(const Output& output, const fs::path& folder) {
  std::string probe = (folder / ".surfseg-probe-XXXXXX").string();
  const int descriptor = ::mkostemp(probe.data(), O_CLOEXEC);
  if (descriptor < 0)
    throw surf::OutputError(fmt::format("{}: {}: cannot be written: {}", output.first,
                                        output.second, std::strerror(errno)));
  ::close(descriptor);
  ::unlink(probe.c_str());
}

void check_output(const Output& output) {
  if (surf::is_stream(output.second)) return;
  const fs::path path(surf::end_of_links(output.second));
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code status;
  if (!fs::is_directory(folder, status))
    throw surf::OutputError(fmt::format("{}: {}: the folder {} does not exist", output.first,
                                        output.second, folder.string()));
  if (fs::is_directory(path, status))
    throw surf::OutputError(
        fmt::format("{}: {}: is a folder; give a file name", output.first, output.second));
  const long longest = ::pathconf(folder.c_str(), _PC_NAME_MAX);
  if (const auto size = path.filename().string().size(); longest > 0 && size > std::size_t(longest))
    throw surf::OutputError(fmt::format("{}: {}: the name has {} bytes; the disk takes {}",
                                        output.first, output.second, size, longest));
  if (!surf::may_be_written(path.string()))
    throw surf::OutputError(fmt::format("{}: {}: cannot be written: {}", output.first,
                                        output.second, std::strerror(errno)));
  check_folder_takes_files(output, folder);
}

std::string identity(const std::string& path) {
  std::error_code status;
  return fs::weakly_canonical(fs::absolute(surf::end_of_links(path), status), status).string();
}

}  // namespace

bool is_read_with(const std::string& input, const std::string& path) {
  std::error_code status;
  const auto type = fs::status(input, status).type();  // a pipe can be read once
  if (type != fs::file_type::regular && type != fs::file_type::directory) return false;
  if (!fs::is_regular_file(path, status)) return false;
  if (fs::equivalent(input, path, status)) return true;
  try {
    const std::vector<std::string> files = surf::volume::volume_files(input);
    const auto is_it = [&](const std::string& file) { return fs::equivalent(file, path, status); };
    if (std::none_of(files.begin(), files.end(), is_it)) return false;
    // Beside the slices of a series there may be what earlier runs have written.
    const bool is_series = type == fs::file_type::directory || surf::volume::is_dicom_image(input);
    return !is_series || surf::volume::is_dicom_image(path);
  } catch (const surf::InputError&) {
    return false;  // no volume, or a broken one, which is said where it is read
  }
}

void check_outputs(const std::vector<Output>& outputs, const std::vector<Output>& inputs) {
  std::vector<Output> seen;
  for (const auto& [name, path] : inputs)
    if (!path.empty()) seen.emplace_back(name, identity(path));
  for (const Output& output : outputs) {
    if (output.second.empty()) continue;
    const std::string path = identity(output.second);
    for (const auto& [other, name] : seen)
      if (name == path)
        throw surf::UsageError(fmt::format("{}: {}: is {} too; give another file name",
                                           output.first, output.second, other));
    for (const auto& [other, input] : inputs)
      if (is_read_with(input, path))
        throw surf::UsageError(fmt::format("{}: {}: is a part of {}; give another file name",
                                           output.first, output.second, other));
    seen.emplace_back(output.first, path);
    check_output(output);
  }
}

void check_volume_name(const std::string& option, const std::string& path) {
  if (!path.empty() && !surf::volume::is_writable_volume(path))
    throw surf::UsageError(fmt::format(
        "{}: {}: expected a name that ends in .nii.gz, .nii, .mha or .nrrd", option, path));
}

void check_label_map_name(const std::string& option, const std::string& path) {
  if (!path.empty() && !surf::volume::is_writable_label_map(path))
    throw surf::UsageError(fmt::format("{}: {}: expected a name that ends in {}", option, path,
                                       surf::volume::writable_label_maps()));
}

void check_picture(const std::string& option, const std::string& path) {
  if (!path.empty() && surf::extension(path) != ".png")
    throw surf::UsageError(fmt::format("{}: {}: expected a name that ends in .png", option, path));
}

void add_output_space(CLI::App& command, std::string& space, const std::string& of,
                      const std::string& group) {
  OptionGroup(command, group)
      .add_choice("--output-space", space, fmt::format("Frame of {}: lps (as Slicer) or ras", of),
                  {"lps", "ras"});
}

surf::io::Space file_space(const std::string& word) {
  return word == "ras" ? surf::io::Space::kRas : surf::io::Space::kLps;
}

}  // namespace surfseg
