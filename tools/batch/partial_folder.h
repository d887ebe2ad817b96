// Where a case is on its way, beside the folder that it will have.
#pragma once

#include <filesystem>
#include <string>

namespace surfseg::batch {

/// A new hidden folder that goes with this object: two runs on one folder do the same work twice,
/// but do not disturb each other. Its lock, which ends with the process, tells that it is used.
class PartialFolder {
 public:
  /// @throws std::filesystem::filesystem_error  it cannot be made
  PartialFolder(const std::filesystem::path& folder, const std::string& case_name);
  ~PartialFolder();
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

/// Others that want the same folder's lock wait while it is held, threads and processes. None where
/// the disk knows no locks.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// Removes those that processes have left which are no more. Where the disk knows no locks, those
/// of the last two days stay.
void remove_left_partial_folders(const std::filesystem::path& folder);

}  // namespace surfseg::batch
