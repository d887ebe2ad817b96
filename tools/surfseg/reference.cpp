#include "tools/surfseg/reference.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/from_label_map.h"
#include "tools/common/outputs.h"

namespace surfseg {

Reference read_reference(const std::string& path, const std::optional<int>& label,
                         const VolumeArguments& which, const std::string& unstated_space) {
  Reference reference;
  if (surf::io::is_readable_surface(path)) {
    if (label) throw surf::UsageError(fmt::format("--label: {} is a mesh and has no labels", path));
    reference.surface = surf::io::read_surface(path, {file_space(unstated_space)});
  } else {
    reference.labels = which.read(path);
    reference.surface = surf::mesh::surface_of_label_map(*reference.labels, label);
  }
  return reference;
}

}  // namespace surfseg
