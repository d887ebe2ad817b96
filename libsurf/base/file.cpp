#include "libsurf/base/file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "libsurf/base/error.h"

namespace surf {

std::string extension(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (name.ends_with(".nii.gz")) return ".nii.gz";
  return std::filesystem::path(name).extension().string();
}

void write_atomically(const std::string& path,
                      const std::function<void(const std::string&)>& write) {
  namespace fs = std::filesystem;
  const fs::path target(path);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code status;
  if (!fs::is_directory(folder, status))
    throw OutputError(fmt::format("{}: the folder {} does not exist", path, folder.string()));
  if (fs::is_directory(target, status))
    throw OutputError(fmt::format("{}: is a folder; give a file name", path));
  const fs::path temporary =
      folder / fmt::format(".surfseg-{}-{}", ::getpid(), target.filename().string());
  try {
    write(temporary.string());
    fs::rename(temporary, target, status);
    if (status) throw OutputError(fmt::format("{}: cannot be written: {}", path, status.message()));
  } catch (...) {
    fs::remove(temporary, status);
    throw;
  }
}

void write_bytes(const std::string& path, std::string_view bytes) {
  write_atomically(path, [&](const std::string& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream)
      throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  });
}

}  // namespace surf
