#include "tools/python/curve.h"

#include <fmt/format.h>

#include <algorithm>

#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/finish.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"

namespace surfseg::python {

Curve::Curve(surf::curve::Image image, std::shared_ptr<const Setting> setting,
             const surf::segment::Object<2>& object)
    : Found(std::move(setting), object), image_(std::move(image)) {}

py::array_t<std::uint8_t> Curve::mask() const {
  const auto flags =
      surf::curve::rasterize(finished().shape, image_.size(), image_.pixel_to_plane());
  py::array_t<std::uint8_t> out({image_.size()[1], image_.size()[0]});
  std::copy(flags.begin(), flags.end(), out.mutable_data());
  return out;
}

void Curve::save(const std::string& path) const {
  check_is_not_input(path, image_.source().path);
  if (surf::extension(path) == ".png")
    surf::curve::write_mask(
        path, image_.size(),
        surf::curve::rasterize(finished().shape, image_.size(), image_.pixel_to_plane()));
  else if (surf::curve::is_writable_contour(path))
    surf::curve::write(path, finished(), image_);
  else
    throw surf::UsageError(fmt::format(
        "{}: expected a name that ends in .svg, .json, .vtp or .csv, or of a mask in .png", path));
}

void add_curve(py::module_& module) {
  add_found<Curve>(module, "Curve", "points", "segments", "area_mm2", "length_mm")
      .def("save", &Curve::save, py::arg("path"), py::call_guard<py::gil_scoped_release>());
}

}  // namespace surfseg::python
