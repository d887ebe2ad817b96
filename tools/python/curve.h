// Curves that were found in an image, for Python.
#pragma once

#include <memory>
#include <string>

#include "libcurve/image/image.h"
#include "tools/python/arrays.h"
#include "tools/python/found.h"

namespace surfseg::python {

/// Verified curves and what is known of them; keep what they came from.
class Curve : public Found<2> {
 public:
  /// @throws surf::NoObject, surf::InvalidMesh  as segment::finish()
  Curve(surf::curve::Image image, std::shared_ptr<const Setting> setting,
        const surf::segment::Object<2>& object);

  /// 1 for pixel centres inside, uint8, indexed [row, column].
  py::array_t<std::uint8_t> mask() const;
  /// As curveseg writes contours; .png is the mask.
  void save(const std::string& path) const;

 private:
  surf::curve::Image image_;
};

void add_curve(py::module_& module);

}  // namespace surfseg::python
