#include "libsurf/segment/object_box.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libsurf/base/error.h"
#include "libsurf/segment/detail/point_text.h"

namespace surf::segment {
namespace {

constexpr double kRounding = 1e-3;  // cells: corners are written with some digits
constexpr int kThinnest = 3;        // cells
constexpr double kLeastGap = 8, kMostGap = 22, kNear = 4, kFar = 25;  // mm, in boxes of kUsual
constexpr int kClose = 2;  // nodes: what reaches a face has leaked, however close the box is drawn
constexpr double kUsual = 40;       // mm: in a smaller box all of these are shorter, as it is
constexpr double kMostOfFar = 1.6;  // of all faces together

/// The axis of the file that runs along this one.
template <int Dim>
int axis_in_file(const ImageExtent<Dim>& extent, int axis) {
  Eigen::Index out = 0;
  (extent.in_file.world_to_index.linear() * extent.index_to_world.linear().col(axis))
      .cwiseAbs()
      .maxCoeff(&out);
  return int(out);
}

}  // namespace

template <int Dim>
NodeBox<Dim> cells_of_box(const ImageExtent<Dim>& extent, const BoxCorners<Dim>& corners_mm) {
  const char* cell = Dim == 3 ? "voxel" : "pixel";
  const auto text = [&] {
    return fmt::format("({}) to ({}) mm", point_text<Dim>(corners_mm[0]),
                       point_text<Dim>(corners_mm[1]));
  };
  for (const Vector<Dim>& corner : corners_mm)
    if (!corner.allFinite()) throw UsageError("Options::box_mm: a corner is not a finite number");
  const auto a = extent.index(corners_mm[0]), b = extent.index(corners_mm[1]);
  NodeBox<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) {
    const double low = std::min(a[axis], b[axis]), high = std::max(a[axis], b[axis]);
    const double first = std::max(0.0, std::ceil(low - 0.5 - kRounding)),
                 last = std::min(extent.size[axis] - 1.0, std::floor(high + 0.5 + kRounding));
    if (!(first <= last))
      throw UsageError(fmt::format(
          "Options::box_mm: {} holds no {} of the {} of {} {}s; is it in another space?", text(),
          cell, Dim == 3 ? "volume" : "image", fmt::join(extent.in_file.size, " x "), cell));
    out.lower[axis] = int(first);
    out.size[axis] = int(last - first) + 1;
    if (out.size[axis] < std::min(kThinnest, extent.size[axis]))
      throw UsageError(
          fmt::format("Options::box_mm: {} is only {} {}s thick along axis {}; the corners are to "
                      "be opposite ones, "
                      "a centimetre or two beyond the object",
                      text(), out.size[axis], cell, "ijk"[axis_in_file(extent, axis)]));
  }
  return out;
}

template <int Dim>
BoxCorners<Dim> holding_box_along_world(const ImageBox<Dim>& image,
                                        const BoxCorners<Dim>& corners_mm) {
  using Index = typename ImageBox<Dim>::Index;
  const Index a = image.index(corners_mm[0]), b = image.index(corners_mm[1]);
  Index low = a.min(b), high = a.max(b);
  const Index least = low, most = high;
  for (int corner = 0; corner < 1 << Dim; ++corner) {
    Vector<Dim> point;
    for (int axis = 0; axis < Dim; ++axis) point[axis] = corners_mm[corner >> axis & 1][axis];
    low = low.min(image.index(point));
    high = high.max(image.index(point));
  }
  // Not for what header's rounding turns an image by.
  if ((low > least - kRounding).all() && (high < most + kRounding).all()) return corners_mm;
  return {image.index_to_world * low.matrix(), image.index_to_world * high.matrix()};
}

template <int Dim>
bool is_in_cells(const ImageExtent<Dim>& extent, const NodeBox<Dim>& cells,
                 const Vector<Dim>& point_mm) {
  const auto index = extent.index(point_mm);
  typename NodeBox<Dim>::Index cell;
  for (int axis = 0; axis < Dim; ++axis) cell[axis] = int(std::lround(index[axis]));
  return cells.contains(cell);
}

template <int Dim>
NodeSet<Dim> outside_faces(const SearchGrid<Dim>& grid) {
  const NodeBox<Dim>& box = grid.box();
  NodeSet<Dim> within = NodeSet<Dim>(box).complement();
  for (int axis = 0; axis < Dim; ++axis) {
    if (grid.is_outside_beyond(axis, false)) within.erase_layers(axis, 0, 1);
    if (grid.is_outside_beyond(axis, true))
      within.erase_layers(axis, box.size[axis] - 1, box.size[axis]);
  }
  return within.complement();
}

template <int Dim>
double box_fit(const SearchGrid<Dim>& grid, const NodeBox<Dim>& object) {
  double near = 0, nearest_to_all = std::numeric_limits<double>::infinity(), far = 0;
  int n_faces = 0, least_nodes = kClose;
  for (int axis = 0; axis < Dim; ++axis)
    for (const bool is_last : {false, true}) {
      if (!grid.is_outside_beyond(axis, is_last)) continue;
      const int before = object.lower[axis],
                after = grid.box().size[axis] - object.lower[axis] - object.size[axis];
      const double gap = grid.node_mm() * (is_last ? after : before),
                   scale = std::min(1.0, grid.node_mm() * grid.box().size[axis] / kUsual),
                   too_near = std::max(0.0, kLeastGap - gap / scale) / kNear,
                   too_far = std::max(0.0, gap / scale - kMostGap) / kFar;
      near += 0.5 * too_near * too_near;
      nearest_to_all = std::min(nearest_to_all, 0.5 * too_near * too_near);
      least_nodes = std::min(least_nodes, is_last ? after : before);
      ++n_faces;
      far += 0.5 * too_far * too_far;
    }
  if (n_faces > 0 && least_nodes >= kClose) near -= n_faces * nearest_to_all;
  return std::exp(-near - std::min(far, kMostOfFar));
}

#define SURF_INSTANTIATE(Dim)                                                               \
  template NodeBox<Dim> cells_of_box<Dim>(const ImageExtent<Dim>&, const BoxCorners<Dim>&); \
  template BoxCorners<Dim> holding_box_along_world<Dim>(const ImageBox<Dim>&,               \
                                                        const BoxCorners<Dim>&);            \
  template bool is_in_cells<Dim>(const ImageExtent<Dim>&, const NodeBox<Dim>&,              \
                                 const Vector<Dim>&);                                       \
  template NodeSet<Dim> outside_faces<Dim>(const SearchGrid<Dim>&);                         \
  template double box_fit<Dim>(const SearchGrid<Dim>&, const NodeBox<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
