#include "libsurf/base/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/no_pipe_signal.h"

namespace surf {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // as Linux
// Of a temporary file's name, which ends as the file's does: the rest is room for what makes it
// one.
constexpr std::size_t kMostOfTheName = 180;

/// Waits until a file or folder is on the disk; false if it cannot be.
bool sync(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool is_synced = ::fsync(descriptor) == 0 || errno == EINVAL;  // no disk to wait for
  ::close(descriptor);
  return is_synced;
}

fs::path folder_of(const fs::path& path) {
  std::error_code status;
  return fs::weakly_canonical(path.parent_path(), status);
}

bool is_of_a_process(const fs::path& path) {
  return folder_of(path).string().starts_with("/proc/");
}

/// Open for writing. What this process has open itself goes on where it is: opened anew, a file
/// would have a place of its own for the next byte.
int opened(const std::string& stream_path) {
  const fs::path path = end_of_links(stream_path);
  const std::string name = path.filename().string();
  const bool is_own =
      folder_of(path) == fs::path(fmt::format("/proc/{}/fd", ::getpid())) && !name.empty() &&
      std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!is_own) return ::open(stream_path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  std::fflush(stdout);
  return ::fcntl(std::atoi(name.c_str()), F_DUPFD_CLOEXEC, 0);
}

bool write_all(int descriptor, const char* bytes, std::size_t n) {
  while (n > 0) {
    const ssize_t written = ::write(descriptor, bytes, n);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes += written;
    n -= std::size_t(written);
  }
  return true;
}

/// @throws OutputError  the bytes cannot all be written
void copy_into(std::ifstream from, const std::string& stream_path) {
  const auto refuse = [&](int error) {
    throw OutputError(fmt::format("{}: cannot be written: {}", stream_path, std::strerror(error)));
  };
  const NoPipeSignal no_signal;
  const int descriptor = opened(stream_path);
  if (descriptor < 0) refuse(errno);
  std::vector<char> bytes(1 << 16);
  while (from) {
    from.read(bytes.data(), std::ssize(bytes));
    if (from.bad() || !write_all(descriptor, bytes.data(), std::size_t(from.gcount()))) {
      const int error = from.bad() ? EIO : errno;
      ::close(descriptor);
      refuse(error);
    }
  }
  if (::close(descriptor) != 0) refuse(errno);
}

/// In a folder of its own, with the ending of `path`.
void write_into_stream(const std::string& path,
                       const std::function<void(const std::string&)>& write) {
  std::error_code status;
  std::string folder = (fs::temp_directory_path(status) / "surfseg-XXXXXX").string();
  if (status || !::mkdtemp(folder.data()))
    throw OutputError(fmt::format("{}: no folder for temporary files (TMPDIR): {}", path,
                                  status ? status.message() : std::strerror(errno)));
  std::ifstream written;
  try {
    const fs::path temporary = fs::path(folder) / fs::path(path).filename();
    write(temporary.string());
    written.open(temporary, std::ios::binary);
  } catch (...) {
    fs::remove_all(folder, status);
    throw;
  }
  const bool is_there = written.is_open();
  fs::remove_all(folder, status);  // its bytes are there as long as they are open
  if (!is_there) throw OutputError(fmt::format("{}: cannot be written: nothing came", path));
  copy_into(std::move(written), path);
}

/// The file that takes another's place has its permissions, and those added; where there was none,
/// what the umask leaves.
void keep_permissions(const fs::path& before, const fs::path& now, mode_t added) {
  struct stat found;
  if (::stat(before.c_str(), &found) == 0)
    (void)!::chmod(now.c_str(), (found.st_mode & 0777) | added);
}

/// Of one file that is being written: processes in containers have the same numbers, and threads of
/// one may write the same name at once.
std::string own_word() {
  static const unsigned of_this_process = std::random_device()();
  static std::atomic<unsigned> n_written = 0;
  return fmt::format("{}-{:08x}-{}", ::getpid(), of_this_process, ++n_written);
}

}  // namespace

std::string end_of_links(const std::string& link) {
  fs::path path = link;
  std::error_code status;
  for (int n = 0; n < kMostLinks && !is_of_a_process(path) && fs::is_symlink(path, status); ++n) {
    const fs::path next = fs::read_symlink(path, status);
    if (status) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path.string();
}

std::vector<std::string> files_in(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> out;
  std::error_code status, unknown;
  for (fs::directory_iterator at(folder, status), end; !status && at != end; at.increment(status))
    if (at->is_regular_file(unknown)) out.push_back(at->path().string());
  if (status) throw InputError(fmt::format("{}: cannot be read: {}", folder, status.message()));
  std::sort(out.begin(), out.end());
  return out;
}

std::string extension(const std::string& path) {
  std::string name = std::filesystem::path(path).filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (name.ends_with(".nii.gz")) return ".nii.gz";
  return std::filesystem::path(name).extension().string();
}

bool is_stream(const std::string& path) {
  std::error_code status;
  const fs::file_status found = fs::status(path, status);
  return (fs::exists(found) && !fs::is_regular_file(found) && !fs::is_directory(found)) ||
         is_of_a_process(end_of_links(path));
}

bool may_be_written(const std::string& path) {
  // AT_EACCESS is a system call of its own, which older containers forbid.
  const int found = ::geteuid() == ::getuid()
                        ? ::access(path.c_str(), W_OK)
                        : ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS);
  return found == 0 || errno == ENOENT;
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
  if (!may_be_written(target.string()))
    throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  std::string name = target.filename().string();
  if (name.size() > kMostOfTheName)
    name = fmt::format("{:x}-{}", std::hash<std::string>()(name),
                       name.substr(name.size() - kMostOfTheName));
  const fs::path temporary = folder / fmt::format(".surfseg-{}-{}", own_word(), name);
  try {
    if (fs::exists(target, status)) {  // nobody else reads on while it is written
      std::ofstream(temporary).close();
      keep_permissions(target, temporary, S_IWUSR);
    }
    write(temporary.string());
    if (!sync(temporary))
      throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
    keep_permissions(target, temporary, 0);
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
