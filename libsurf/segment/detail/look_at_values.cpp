#include "libsurf/segment/detail/look_at_values.h"

#include <algorithm>

#include "libsurf/base/padding.h"
#include "libsurf/base/usual_range.h"

namespace surf::segment {
namespace {

constexpr int kLinesAlongAxis = 32;  // at most

/// Of lines along the first axis.
template <int Dim>
std::vector<float> some_values(const Setting<Dim>& setting,
                               const typename IndexBox<Dim>::Index& size) {
  typename IndexBox<Dim>::Index count;
  for (int axis = 0; axis < Dim; ++axis)
    count[axis] = axis == 0 ? 1 : std::min(size[axis], kLinesAlongAxis);
  const IndexBox<Dim> lines{{}, count};
  std::vector<float> out;
  for (std::size_t n = 0; n < lines.n(); ++n) {
    typename IndexBox<Dim>::Index first = lines.node(n), end;
    for (int axis = 1; axis < Dim; ++axis) {
      first[axis] = int((2L * first[axis] + 1) * size[axis] / (2L * count[axis]));
      end[axis] = first[axis] + 1;
    }
    end[0] = size[0];
    const std::vector<float> line = setting.values(first, end);
    out.insert(out.end(), line.begin(), line.end());
  }
  return out;
}

}  // namespace

template <int Dim>
void look_at_values(const Setting<Dim>& setting, ImageExtent<Dim>& extent) {
  extent.usual = usual_range(extent.range, some_values(setting, extent.size));
  extent.scanned = box_within_padding<Dim>(extent.size, [&](const auto& lower, const auto& upper) {
    return setting.values(lower, upper);
  });
}

template void look_at_values<2>(const Setting<2>&, ImageExtent<2>&);
template void look_at_values<3>(const Setting<3>&, ImageExtent<3>&);

}  // namespace surf::segment
