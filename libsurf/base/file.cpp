#include "libsurf/base/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

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

/// What takes bytes but is no file that another could take the place of: a device, a pipe, a
/// socket; and what a descriptor of a process has open, as /dev/stdout.
bool is_stream(fs::path path) {
  std::error_code status;
  const fs::file_status found = fs::status(path, status);
  if (fs::exists(found) && !fs::is_regular_file(found) && !fs::is_directory(found)) return true;
  const auto is_of_a_process = [&] {
    return fs::weakly_canonical(path.parent_path(), status).string().starts_with("/proc/");
  };
  for (int n = 0; n < kMostLinks && !is_of_a_process() && fs::is_symlink(path, status); ++n) {
    const fs::path next = fs::read_symlink(path, status);
    if (status) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return is_of_a_process();
}

/// @throws OutputError  the bytes cannot all be written
void copy_into(const fs::path& from, const std::string& stream_path) {
  const auto refuse = [&] {
    throw OutputError(fmt::format("{}: cannot be written: {}", stream_path, std::strerror(errno)));
  };
  const int descriptor = ::open(stream_path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor < 0) refuse();
  std::ifstream in(from, std::ios::binary);
  std::vector<char> bytes(1 << 16);
  bool is_written = true;
  while (is_written && in) {
    in.read(bytes.data(), std::ssize(bytes));
    for (std::ptrdiff_t done = 0; is_written && done < in.gcount();) {
      const ssize_t n = ::write(descriptor, bytes.data() + done, std::size_t(in.gcount() - done));
      if (n >= 0)
        done += n;
      else if (errno != EINTR)
        is_written = false;
    }
  }
  const int error = errno;
  if ((::close(descriptor) != 0 && is_written) || !is_written) {
    if (!is_written) errno = error;
    refuse();
  }
}

/// In a folder of its own, with the ending of `path`.
void write_into_stream(const std::string& path,
                       const std::function<void(const std::string&)>& write) {
  std::string folder = (fs::temp_directory_path() / "surfseg-XXXXXX").string();
  if (!::mkdtemp(folder.data()))
    throw OutputError(fmt::format("{}: {}", folder, std::strerror(errno)));
  std::error_code status;
  const fs::path temporary = fs::path(folder) / fs::path(path).filename();
  try {
    write(temporary.string());
    copy_into(temporary, path);
  } catch (...) {
    fs::remove_all(folder, status);
    throw;
  }
  fs::remove_all(folder, status);
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
  if (is_stream(path)) return write_into_stream(path, write);
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
