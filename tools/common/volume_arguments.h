// Which frame and series of a volume's file: the options of every verb that reads volumes.
#pragma once

#include <string>

#include "libsurf/volume/volume.h"
#include "tools/common/cli_app.h"

namespace surfseg {

struct VolumeArguments {
  int frame_index = 0;
  std::string series_uid;

  void add_to(CLI::App& command, const std::string& group = "Options");
  /// These, with this series where none was typed.
  VolumeArguments or_series(const std::string& uid) const;
  /// What can be found wrong before the file is read.
  /// @throws surf::UsageError
  void check() const;
  /// Of a file that is no volume.
  /// @param what  it is or holds: "is a mesh"
  /// @throws surf::UsageError  a frame or a series was typed
  void check_unused(const std::string& path, const std::string& what) const;
  /// @throws surf::UsageError, surf::InputError
  surf::volume::Volume read(const std::string& path) const;
};

}  // namespace surfseg
