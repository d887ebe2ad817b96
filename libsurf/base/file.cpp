#include "libsurf/base/file.h"

#include <fcntl.h>
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
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // as Linux

/// The file that a link leads to, be it there or not, so that the link stays one.
fs::path end_of_links(fs::path path) {
  std::error_code status;
  for (int n = 0; n < kMostLinks && fs::is_symlink(path, status); ++n) {
    const fs::path next = fs::read_symlink(path, status);
    if (status) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

/// Waits until a file or folder is on the disk; false if it cannot be.
bool sync(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool is_synced = ::fsync(descriptor) == 0 || errno == EINVAL;  // no disk to wait for
  ::close(descriptor);
  return is_synced;
}

}  // namespace

std::string extension(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (name.ends_with(".nii.gz")) return ".nii.gz";
  return std::filesystem::path(name).extension().string();
}

void write_atomically(const std::string& path,
                      const std::function<void(const std::string&)>& write) {
  const fs::path target = end_of_links(path);
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
    if (!sync(temporary))
      throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
    fs::rename(temporary, target, status);
    if (status) throw OutputError(fmt::format("{}: cannot be written: {}", path, status.message()));
    sync(folder);  // of the name; some file systems do not know how
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
