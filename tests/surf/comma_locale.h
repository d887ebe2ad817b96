// The decimal comma of most of Europe, as Qt and Python set it for a whole process.
#pragma once

#include <clocale>
#include <cstdlib>
#include <string>

namespace surf::test {

/// While it lives numbers of C functions have a comma.
class CommaLocale {
 public:
  /// @param folder  that does not exist: one is made in it where none is installed
  explicit CommaLocale(const std::string& folder) {
    for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "es_ES.UTF-8"})
      if (set(name)) return;
    const std::string command = "mkdir '" + folder + "' && localedef -i de_DE -f UTF-8 '" + folder +
                                "/de_DE.UTF-8' > /dev/null 2>&1";
    (void)!std::system(command.c_str());
    ::setenv("LOCPATH", folder.c_str(), 1);
    set("de_DE.UTF-8");
  }
  ~CommaLocale() {
    std::setlocale(LC_NUMERIC, "C");
    ::unsetenv("LOCPATH");
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

  /// False where there is none, and nothing to make one of.
  bool is_set() const { return is_set_; }

 private:
  bool set(const char* name) {
    return is_set_ = std::setlocale(LC_NUMERIC, name) && *std::localeconv()->decimal_point == ',';
  }

  bool is_set_ = false;
};

}  // namespace surf::test
