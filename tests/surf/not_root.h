// Permissions, which root need not heed.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <string>

namespace surf::test {

/// While it lives a process of root may do what anybody may.
class NotRoot {
 public:
  NotRoot() : was_root_(::geteuid() == 0 && ::seteuid(kNobody) == 0) {}
  ~NotRoot() {
    if (was_root_) (void)!::seteuid(0);
  }
  /// Whether it has become somebody who may write into a folder.
  bool may_enter(const std::string& folder) const {
    return ::geteuid() != 0 && ::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0;
  }
  NotRoot(const NotRoot&) = delete;
  NotRoot& operator=(const NotRoot&) = delete;

 private:
  static constexpr uid_t kNobody = 65534;
  bool was_root_;
};

}  // namespace surf::test
