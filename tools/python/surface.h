// A surface that was found, for Python.
#pragma once

#include <memory>
#include <string>

#include "tools/python/arrays.h"
#include "tools/python/found.h"

namespace surfseg::python {

/// A verified surface and what is known of it; keeps what it came from.
class Surface : public Found<3> {
 public:
  /// @throws surf::NoObject, surf::InvalidMesh  as segment::finish()
  Surface(surf::volume::Volume volume, std::shared_ptr<const Setting> setting,
          const surf::segment::Object<3>& object);

  /// kappa of each vertex [1/mm], see segment::curvature().
  py::array_t<double> curvature() const;
  /// 1 for voxel centres inside, uint8, indexed [i, j, k].
  py::array_t<std::uint8_t> mask() const;
  /// As the program writes it: the same bytes. A name that ends as a label map's, or in .seg.dcm,
  /// is the mask.
  /// @param space  "lps", "ras"
  void save(const std::string& path, const std::string& space) const;
  /// Scores against a mesh or a label map.
  std::string scores(const std::string& reference, std::optional<int> label) const;

 private:
  surf::volume::Volume volume_;
};

void add_surface(py::module_& module);

}  // namespace surfseg::python
