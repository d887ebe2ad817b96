// What segment and replay share: the image that is read, and what is written of contours in it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libcurve/image/image.h"
#include "tools/common/outputs.h"
#include "tools/common/segment_command.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {

/// The files as they were typed.
struct CurveFiles {
  ImageArguments image;
  std::string output, output_space = "lps", mask;

  const std::string& input() const { return image.path; }
  std::vector<Output> outputs() const { return {{"-o", output}, {"--mask", mask}}; }
  /// What can be found wrong with the outputs' names.
  /// @throws surf::UsageError
  void check() const;
};

class CurveCommand : public SegmentCommand<2> {
 public:
  using Files = CurveFiles;
  static constexpr const char* kInputOption = "--image";

  /// @param files  are kept, as the others are
  CurveCommand(const CLI::App& command, const RunArguments& arguments, const CurveFiles& files)
      : SegmentCommand<2>(command, arguments), files_(files) {}

 protected:
  /// Reads the image, or the slice, in this file, with notes to progress().
  std::shared_ptr<const surf::segment::Setting<2>> open(const std::string& path);
  /// Once it is open.
  const surf::curve::Image& image() const { return *image_; }

  std::string output() const override { return files_.output; }
  std::string image_path() const override { return path_; }
  const char* program() const override { return "curveseg"; }
  void write(const surf::segment::Object<2>& object,
             const surf::segment::Finished<2>& finished) const override;
  void write_together(const surf::Segments&,
                      const std::vector<surf::segment::Click<2>>&) const override {}
  /// One object is white, 255; where -o asks for all of several they have their labels.
  void write_labels(const std::vector<std::uint8_t>& labels) const override;
  void write_shape(const std::string& path, const surf::segment::Finished<2>& shape) const override;
  std::string describe(const surf::segment::Measures<2>& measures) const override;

 private:
  const CurveFiles& files_;
  std::string path_;
  std::optional<surf::curve::Image> image_;
};

}  // namespace surfseg::curve_program
