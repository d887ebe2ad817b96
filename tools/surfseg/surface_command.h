// What segment and replay share: the volume that is read, and what is written of surfaces in it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/io/write_surface.h"
#include "libsurf/volume/volume.h"
#include "tools/common/image_command.h"
#include "tools/common/outputs.h"
#include "tools/common/volume_arguments.h"

namespace surfseg {

/// The files as they were typed.
struct SurfaceFiles {
  std::string volume, output, output_space = "lps", mask, picture, thumbnail, report, reference;
  std::optional<int> reference_label;
  VolumeArguments which;

  const std::string& input() const { return volume; }
  const std::string& series_uid() const { return which.series_uid; }
  /// @param series_uid  where none was typed
  /// @throws surf::InputError  also if DICOM is to be written and the volume is none
  surf::volume::Volume read(const std::string& path, const std::string& series_uid) const;
  static std::shared_ptr<const surf::segment::Setting<3>> setting(
      const surf::volume::Volume& volume);
  std::vector<Output> outputs() const;
  /// What is read besides the volume, a pattern as the outputs are.
  std::vector<Output> references() const { return {{"--reference", reference}}; }
  surf::io::WriteOptions write_options() const { return {file_space(output_space)}; }
  /// What can be found wrong before the volume is read.
  /// @throws surf::UsageError
  void check() const;
  /// What can be found wrong with --reference before the work is done.
  /// @param objects  names of those that are written; none = one without a name
  /// @throws surf::UsageError  {object} without names, or one label for several objects
  /// @throws surf::InputError  an object's file is missing
  void check_reference(const std::vector<std::string>& objects) const;
};

/// --report and --reference.
void add_report_options(CLI::App& command, SurfaceFiles& files, const std::string& group);

class SurfaceCommand : public ImageCommand<3, SurfaceFiles> {
 public:
  using ImageCommand::ImageCommand;
  static constexpr const char* kInputOption = "--volume";

 protected:
  const char* program() const override { return "surfseg"; }
  void write(const surf::segment::Object<3>& object,
             const surf::segment::Finished<3>& finished) const override;
  void write_together(const surf::Triangles& all,
                      const std::vector<surf::segment::Click<3>>& clicks) const override;
  surf::ImageBox<3> image_box() const override;
  void write_labels(const std::vector<std::uint8_t>& labels,
                    const std::vector<surf::volume::LabelName>& names) const override;
  void write_shape(const std::string& path, const surf::segment::Finished<3>& shape,
                   const surf::segment::Object<3>& object) const override;
  void measure(const surf::segment::Object<3>& object, const surf::segment::Finished<3>& finished,
               int label, nlohmann::ordered_json& entry) override;
  void write_report(ExitCode exit_code,
                    const std::vector<ReportedObject<3>>& objects) const override;
  std::string describe(const surf::segment::Measures<3>& measures) const override;
};

}  // namespace surfseg
