// Curves that were found in an image, for Python.
#pragma once

#include <memory>
#include <string>

#include "libcurve/image/image.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/history.h"
#include "tools/python/arrays.h"

namespace surfseg::python {

/// Verified curves and what is known of them; keep what they came from.
class Curve {
 public:
  using Setting = surf::segment::Setting<2>;

  /// @throws surf::NoObject, surf::InvalidMesh  as segment::finish()
  Curve(surf::curve::Image image, std::shared_ptr<const Setting> setting,
        const surf::segment::Object<2>& object);

  const surf::segment::Finished<2>& finished() const { return finished_; }
  std::string outcome() const { return to_string(object_.state()); }
  /// The summary that `curveseg segment --json` writes, without what it says of files.
  std::string summary() const;
  /// 1 for pixel centres inside, uint8, indexed [row, column].
  py::array_t<std::uint8_t> mask() const;
  /// As curveseg writes contours; .png is the mask.
  void save(const std::string& path) const;

 private:
  surf::curve::Image image_;
  std::shared_ptr<const Setting> setting_;
  surf::segment::Object<2> object_;
  surf::segment::Finished<2> finished_;
};

void add_curve(py::module_& module);

}  // namespace surfseg::python
