#include "libsurf/segment/clicks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/segment/detail/point_text.h"
#include "libsurf/segment/object_box.h"

namespace surf::segment {
namespace {

template <int Dim>
const char* cell_word() {
  return Dim == 3 ? "voxel" : "pixel";
}

template <int Dim>
std::array<long, Dim> cell_of(const ImageExtent<Dim>& extent, const Vector<Dim>& point_mm) {
  const Vector<Dim> index = extent.world_to_index * point_mm;
  std::array<long, Dim> out;
  for (int axis = 0; axis < Dim; ++axis) out[axis] = std::lround(index[axis]);
  return out;
}

}  // namespace

template <int Dim>
void check_click(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                 const Click<Dim>& click) {
  if (!click.point_mm.allFinite() || !extent.contains(click.point_mm))
    throw UsageError(fmt::format(
        "Click::point_mm{}: ({}) mm is {} ({:.1f}), outside the {} of {} {}s; is it in another "
        "space?",
        click.side == Side::kInside ? "" : "[outside]", point_text<Dim>(click.point_mm),
        cell_word<Dim>(), fmt::join(Vector<Dim>(extent.world_to_index * click.point_mm), ", "),
        Dim == 3 ? "volume" : "image", fmt::join(extent.size, " x "), cell_word<Dim>()));
  for (const Click<Dim>& other : clicks)
    if (other.side != click.side &&
        cell_of<Dim>(extent, other.point_mm) == cell_of<Dim>(extent, click.point_mm))
      throw UsageError(fmt::format(
          "Click::side: ({}) mm is in the same {} as an {} click; take that one back first",
          point_text<Dim>(click.point_mm), cell_word<Dim>(),
          other.side == Side::kInside ? "inside" : "outside"));
}

template <int Dim>
void check_beside(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                  const std::string& name, const Click<Dim>& click) {
  if (click.side != Side::kInside) return;
  for (const Click<Dim>& other : clicks)
    if (other.side == Side::kInside &&
        cell_of<Dim>(extent, other.point_mm) == cell_of<Dim>(extent, click.point_mm))
      throw UsageError(fmt::format(
          "Click::point_mm: ({}) mm is in the same {} as an inside click of '{}': no {} is in two "
          "objects; take that one back first",
          point_text<Dim>(click.point_mm), cell_word<Dim>(), name, cell_word<Dim>()));
}

template <int Dim>
void check_box(const ImageExtent<Dim>& extent, const std::optional<BoxCorners<Dim>>& box_mm,
               const std::vector<Click<Dim>>& clicks) {
  if (!box_mm) return;
  const NodeBox<Dim> cells = cells_of_box(extent, *box_mm);
  for (const Click<Dim>& click : clicks)
    if (click.side == Side::kInside && !is_in_cells(extent, cells, click.point_mm))
      throw UsageError(fmt::format("Options::box_mm: the inside click ({}) mm is outside the box",
                                   point_text<Dim>(click.point_mm)));
}

template <int Dim>
std::vector<Vector<Dim>> points_on(Side side, const std::vector<Click<Dim>>& clicks) {
  std::vector<Vector<Dim>> out;
  for (const Click<Dim>& click : clicks)
    if (click.side == side) out.push_back(click.point_mm);
  return out;
}

template <int Dim>
std::vector<Click<Dim>> as_outside(const std::vector<Click<Dim>>& clicks) {
  std::vector<Click<Dim>> out;
  for (const Click<Dim>& click : clicks) {
    if (click.side != Side::kInside) continue;
    out.push_back(click);
    out.back().side = Side::kOutside;
  }
  return out;
}

template <int Dim>
bool heeds(const Simplices<Dim>& shape, const std::vector<Click<Dim>>& clicks) {
  if (clicks.empty()) return true;
  Points<Dim> points(Eigen::Index(clicks.size()), Dim);
  for (std::size_t n = 0; n < clicks.size(); ++n)
    points.row(Eigen::Index(n)) = clicks[n].point_mm.transpose();
  const std::vector<char> is_inside = mesh::are_inside<Dim>(shape, points);
  for (std::size_t n = 0; n < clicks.size(); ++n)
    if (bool(is_inside[n]) != (clicks[n].side == Side::kInside)) return false;
  return true;
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template void check_click<Dim>(const ImageExtent<Dim>&, const std::vector<Click<Dim>>&,      \
                                 const Click<Dim>&);                                           \
  template void check_beside<Dim>(const ImageExtent<Dim>&, const std::vector<Click<Dim>>&,     \
                                  const std::string&, const Click<Dim>&);                      \
  template void check_box<Dim>(const ImageExtent<Dim>&, const std::optional<BoxCorners<Dim>>&, \
                               const std::vector<Click<Dim>>&);                                \
  template std::vector<Vector<Dim>> points_on<Dim>(Side, const std::vector<Click<Dim>>&);      \
  template std::vector<Click<Dim>> as_outside<Dim>(const std::vector<Click<Dim>>&);            \
  template bool heeds<Dim>(const Simplices<Dim>&, const std::vector<Click<Dim>>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
