#include "tools/batch/partial_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <vector>

#include "tools/batch/derivatives.h"

namespace surfseg::batch {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPartial = ".partial";
constexpr std::chrono::seconds kToBeLocked(60);  // one that has just been made
constexpr std::chrono::hours kLongAgo(48);

int open_folder(const fs::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

bool is_left(const fs::directory_entry& entry) {
  std::error_code status;
  const auto written = entry.last_write_time(status);
  if (status) return false;  // it has just gone
  const auto age = fs::file_time_type::clock::now() - written;
  const int descriptor = open_folder(entry.path());
  if (descriptor < 0) return false;
  const bool is_free = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  const bool is_used = !is_free && errno == EWOULDBLOCK;
  ::close(descriptor);
  return is_free ? age > kToBeLocked : !is_used && age > kLongAgo;
}

}  // namespace

PartialFolder::PartialFolder(const fs::path& folder, const std::string& case_name) {
  std::string name =
      (folder / fmt::format(".{}{}-XXXXXX", case_folder(case_name), kPartial)).string();
  if (!::mkdtemp(name.data()))
    throw fs::filesystem_error("cannot be made", name,
                               std::error_code(errno, std::generic_category()));
  path_ = name;
  lock_ = open_folder(path_);
  if (lock_ >= 0) (void)!::flock(lock_, LOCK_EX | LOCK_NB);
}

PartialFolder::~PartialFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

FolderLock::FolderLock(const fs::path& folder) : descriptor_(open_folder(folder)) {
  while (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void remove_left_partial_folders(const fs::path& folder) {
  std::error_code status;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(folder, status), end; at != end; at.increment(status)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(".sub-") && name.find(kPartial) != std::string::npos && is_left(*at))
      left.push_back(at->path());
  }
  for (const fs::path& path : left) fs::remove_all(path, status);
}

}  // namespace surfseg::batch
