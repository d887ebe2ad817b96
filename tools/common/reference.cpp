#include "tools/common/reference.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/measure.h"
#include "tools/common/outputs.h"

namespace surfseg {
namespace {

constexpr int kMostLabels = 255;

/// What speaks against labels, if anything does: intensities have values that are negative or no
/// whole numbers, or many.
std::optional<std::string> no_label_map(const surf::volume::Volume& volume) {
  const auto [nx, ny, nz] = volume.size();
  std::vector<float> slice(std::size_t(nx) * ny);
  std::vector<char> is_there(1 << 16, 0);
  int n_labels = 0;
  for (int k = 0; k < nz; ++k) {
    volume.copy_box({0, 0, k}, {nx, ny, k + 1}, slice.data());
    for (const float value : slice) {
      if (value == 0) continue;
      if (!(value > 0) || value != std::floor(value)) return fmt::format("{} is no label", value);
      if (value >= float(is_there.size()) || is_there[std::size_t(value)]) continue;
      is_there[std::size_t(value)] = 1;
      if (++n_labels > kMostLabels) return fmt::format("more than {} values", kMostLabels);
    }
  }
  return std::nullopt;
}

}  // namespace

surf::Triangles read_compared(const std::string& path, const std::string& unstated_space) {
  surf::Triangles out = surf::io::read_surface(path, {file_space(unstated_space)});
  if (!(surf::mesh::area_mm2(out) > 0))
    throw surf::InputError(fmt::format(
        "{}: none of its triangles has an area, so that nothing can be compared", path));
  return out;
}

void warn_in_log(const std::string& message) { surf::log(surf::LogLevel::kWarning, message); }

Reference read_reference(const std::string& path, const std::optional<int>& label,
                         const VolumeArguments& which, const std::string& unstated_space,
                         const std::function<void(const std::string&)>& warn) {
  Reference reference;
  if (surf::io::is_readable_surface(path)) {
    if (label) throw surf::UsageError(fmt::format("--label: {} is a mesh and has no labels", path));
    which.check_unused(path, "is a mesh");
    reference.surface = read_compared(path, unstated_space);
  } else {
    reference.labels = which.read(path);
    if (const auto why = label ? std::nullopt : no_label_map(*reference.labels))
      warn(fmt::format("{}: {}: is this a label map? All voxels that are not 0 count as the object",
                       path, *why));
    reference.surface = surf::mesh::surface_of_label_map(*reference.labels, label);
  }
  return reference;
}

}  // namespace surfseg
