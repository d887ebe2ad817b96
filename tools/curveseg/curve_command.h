// What segment and replay share: the image that is read, and what is written of contours in it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "libcurve/image/image.h"
#include "tools/common/image_command.h"
#include "tools/common/outputs.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {

/// The files as they were typed.
struct CurveFiles {
  ImageArguments image;
  std::string output, output_space = "lps", mask;

  const std::string& input() const { return image.path; }
  const std::string& series_uid() const { return image.which.series_uid; }
  /// An image, or a slice, of this file.
  /// @param series_uid  where none was typed
  surf::curve::Image read(const std::string& path, const std::string& series_uid) const;
  static std::shared_ptr<const surf::segment::Setting<2>> setting(const surf::curve::Image& image);
  std::vector<Output> outputs() const { return {{"-o", output}, {"--mask", mask}}; }
  static std::vector<Output> references() { return {}; }
  static void check_reference(const std::vector<std::string>&) {}
  /// What can be found wrong with the outputs' names.
  /// @throws surf::UsageError
  void check() const;
};

class CurveCommand : public ImageCommand<2, CurveFiles> {
 public:
  using ImageCommand::ImageCommand;
  static constexpr const char* kInputOption = "--image";

 protected:
  const char* program() const override { return "curveseg"; }
  void write_together(const surf::Segments&,
                      const std::vector<surf::segment::Click<2>>&) const override {}
  surf::ImageBox<2> image_box() const override;
  /// One object is white, 255; where -o asks for all of several they have their labels.
  void write_labels(const std::vector<std::uint8_t>& labels,
                    const std::vector<surf::volume::LabelName>& names) const override;
  void write_shape(const std::string& path, const surf::segment::Finished<2>& shape,
                   const surf::segment::Object<2>& object) const override;
  std::string describe(const surf::segment::Measures<2>& measures) const override;
};

}  // namespace surfseg::curve_program
