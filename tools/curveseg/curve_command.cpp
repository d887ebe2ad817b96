#include "tools/curveseg/curve_command.h"

#include <fmt/format.h>

#include "libcurve/image/write_image.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/finish.h"
#include "libcurve/segment/segment.h"
#include "tools/curveseg/curve_run.h"

namespace surfseg::curve_program {

void CurveFiles::check() const {
  check_contour_output(output);
  check_picture("--mask", mask);
  check_is_of_all("--mask", mask);
}

surf::curve::Image CurveFiles::read(const std::string& path, const std::string& series_uid) const {
  ImageArguments which = image;
  which.path = path;
  which.which = which.which.or_series(series_uid);
  return which.read();
}

std::shared_ptr<const surf::segment::Setting<2>> CurveFiles::setting(
    const surf::curve::Image& image) {
  return surf::curve::make_setting(image);
}

surf::ImageBox<2> CurveCommand::image_box() const {
  return {image().size(), image().pixel_to_plane(), image().plane_to_pixel()};
}

void CurveCommand::write_labels(const std::vector<std::uint8_t>& labels,
                                const std::vector<surf::volume::LabelName>& /*names*/) const {
  if (has_object(files().output))
    surf::curve::write_labels(files().mask, image().size(), labels);
  else
    surf::curve::write_mask(files().mask, image().size(), labels);
}

void CurveCommand::write_shape(const std::string& path, const surf::segment::Finished<2>& shape,
                               const surf::segment::Object<2>& /*object*/) const {
  surf::curve::write(path, shape, image(), file_space(files().output_space));
}

std::string CurveCommand::describe(const surf::segment::Measures<2>& measures) const {
  return fmt::format("{} elements, {} region{}, {:.5g} mm^2, {:.5g} mm, closed, simple",
                     measures.n_elements, measures.components.size(),
                     measures.components.size() == 1 ? "" : "s", measures.content,
                     measures.measure);
}

}  // namespace surfseg::curve_program
