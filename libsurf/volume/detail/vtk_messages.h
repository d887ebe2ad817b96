// What VTK would print on stderr; in the library surf_vtk.
#pragma once

#include <memory>
#include <string>

namespace surf::volume {

/// Collects VTK's messages while it lives. VTK has one window and one log for the whole process
/// (observers do not reach all the objects inside a reader), so that one thread at a time has one.
class VtkMessages {
 public:
  VtkMessages();
  ~VtkMessages();

  bool has_error() const;
  /// The first message without the source file and the object's address, on one line.
  std::string first() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
