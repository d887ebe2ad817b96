// What VTK would print on stderr.
#pragma once

#include <memory>

namespace surf {

/// Takes VTK's messages in place of its output window while it lives: readers, parsers and arrays
/// each report in their own way, and a truncated file may be read without any other sign.
class VtkMessages {
 public:
  VtkMessages();
  ~VtkMessages();

  bool has_error() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf
