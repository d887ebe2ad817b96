// What segment and replay share: the volume that is read, and what is written of surfaces in it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/io/write_surface.h"
#include "libsurf/volume/volume.h"
#include "tools/common/outputs.h"
#include "tools/common/segment_command.h"
#include "tools/common/volume_arguments.h"

namespace surfseg {

/// The files as they were typed.
struct SurfaceFiles {
  std::string volume, output, output_space = "lps", mask, picture;
  VolumeArguments which;

  const std::string& input() const { return volume; }
  std::vector<Output> outputs() const;
  surf::io::WriteOptions write_options() const { return {file_space(output_space)}; }
  /// What can be found wrong before the volume is read.
  /// @throws surf::UsageError
  void check() const;
};

class SurfaceCommand : public SegmentCommand<3> {
 public:
  using Files = SurfaceFiles;
  static constexpr const char* kInputOption = "--volume";

  /// @param files  are kept, as the others are
  SurfaceCommand(const CLI::App& command, const RunArguments& arguments, const SurfaceFiles& files)
      : SegmentCommand<3>(command, arguments), files_(files) {}

 protected:
  /// Reads the volume in this file, with notes to progress().
  std::shared_ptr<const surf::segment::Setting<3>> open(const std::string& path);
  /// Once it is open.
  const surf::volume::Volume& volume() const { return *volume_; }

  std::string output() const override { return files_.output; }
  std::string image_path() const override { return path_; }
  const char* program() const override { return "surfseg"; }
  void write(const surf::segment::Object<3>& object,
             const surf::segment::Finished<3>& finished) const override;
  void write_together(const surf::Triangles& all,
                      const std::vector<surf::segment::Click<3>>& clicks) const override;
  void write_labels(const std::vector<std::uint8_t>& labels) const override;
  void write_shape(const std::string& path, const surf::segment::Finished<3>& shape) const override;
  std::string describe(const surf::segment::Measures<3>& measures) const override;

 private:
  const SurfaceFiles& files_;
  std::string path_;
  std::optional<surf::volume::Volume> volume_;
};

}  // namespace surfseg
