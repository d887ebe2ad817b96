#include "tools/curveseg/curve_command.h"

#include <fmt/format.h>

#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/segment.h"
#include "tools/common/objects.h"
#include "tools/curveseg/curve_run.h"

namespace surfseg::curve_program {

void CurveFiles::check() const {
  check_contour_output(output);
  check_picture("--mask", mask);
}

std::shared_ptr<const surf::segment::Setting<2>> CurveCommand::open(const std::string& path) {
  path_ = path;
  ImageArguments which = files_.image;
  which.path = path;
  image_ = which.read();
  for (const std::string& note : image_->source().notes) progress().note("note: " + note);
  return surf::curve::make_setting(*image_);
}

void CurveCommand::write(const surf::segment::Object<2>& object,
                         const surf::segment::Finished<2>& finished) const {
  write_shape(object_path(files_.output, object.name), finished);
}

void CurveCommand::write_labels(const std::vector<std::uint8_t>& labels) const {
  if (files_.mask.empty()) return;
  if (has_object(files_.output))
    surf::curve::write_labels(files_.mask, image().size(), labels);
  else
    surf::curve::write_mask(files_.mask, image().size(), labels);
}

void CurveCommand::write_shape(const std::string& path,
                               const surf::segment::Finished<2>& shape) const {
  surf::curve::write_contours(path, shape.shape, image(), file_space(files_.output_space));
}

std::string CurveCommand::describe(const surf::segment::Measures<2>& measures) const {
  return fmt::format("{} elements, {} regions, {:.5g} mm^2, {:.5g} mm, closed, simple",
                     measures.n_elements, measures.components.size(), measures.content,
                     measures.measure);
}

}  // namespace surfseg::curve_program
