#include "tools/surfseg/reference.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/from_label_map.h"
#include "tools/common/outputs.h"

namespace surfseg {
namespace {

/// A value that no label has, if there is one: intensities have some that are negative or no whole
/// numbers.
std::optional<float> value_of_no_label(const surf::volume::Volume& volume) {
  const auto [nx, ny, nz] = volume.size();
  std::vector<float> slice(std::size_t(nx) * ny);
  for (int k = 0; k < nz; ++k) {
    volume.copy_box({0, 0, k}, {nx, ny, k + 1}, slice.data());
    for (const float value : slice)
      if (value < 0 || value != std::floor(value)) return value;
  }
  return std::nullopt;
}

}  // namespace

Reference read_reference(const std::string& path, const std::optional<int>& label,
                         const VolumeArguments& which, const std::string& unstated_space) {
  Reference reference;
  if (surf::io::is_readable_surface(path)) {
    if (label) throw surf::UsageError(fmt::format("--label: {} is a mesh and has no labels", path));
    reference.surface = surf::io::read_surface(path, {file_space(unstated_space)});
  } else {
    reference.labels = which.read(path);
    if (const auto value = label ? std::nullopt : value_of_no_label(*reference.labels))
      surf::log(surf::LogLevel::kWarning,
                fmt::format("{}: {} is no label: is this a label map? All voxels that are not 0 "
                            "count as the object",
                            path, *value));
    reference.surface = surf::mesh::surface_of_label_map(*reference.labels, label);
  }
  return reference;
}

}  // namespace surfseg
