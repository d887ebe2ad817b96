#include "libsurf/segment/clicks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/segment/detail/point_text.h"
#include "libsurf/segment/object_box.h"

namespace surf::segment {
namespace {

constexpr double kLeastEdge = 0.02;  // cells

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

template <int Dim>
std::vector<Vector<Dim>> points_of(const Click<Dim>& click) {
  std::vector<Vector<Dim>> out = {click.point_mm};
  out.insert(out.end(), click.stroke_mm.begin(), click.stroke_mm.end());
  return out;
}

/// The first point of the click that is in a cell with a point of a click on this side.
template <int Dim>
std::optional<Vector<Dim>> point_in_common(const ImageExtent<Dim>& extent,
                                           const std::vector<Click<Dim>>& clicks, Side side,
                                           const Click<Dim>& click) {
  std::set<std::array<long, Dim>> cells;
  const std::vector<Vector<Dim>> points = points_of(click);
  for (const Vector<Dim>& point : points) cells.insert(cell_of<Dim>(extent, point));
  for (const Click<Dim>& other : clicks) {
    if (other.side != side) continue;
    for (const Vector<Dim>& point : points_of(other)) {
      const auto cell = cell_of<Dim>(extent, point);
      if (!cells.contains(cell)) continue;
      return *std::find_if(points.begin(), points.end(), [&](const Vector<Dim>& own) {
        return cell_of<Dim>(extent, own) == cell;
      });
    }
  }
  return std::nullopt;
}

/// "12.0, -30.5, 44.1"
template <int Dim>
std::string index_text(const Vector<Dim>& index) {
  constexpr double kMany = 1e9;  // digits of what is further off say nothing
  std::string out;
  for (const double x : index)
    out += (out.empty() ? "" : ", ") +
           (std::abs(x) < kMany ? fmt::format("{:.1f}", x) : fmt::format("{:g}", x));
  return out;
}

}  // namespace

template <int Dim>
void check_click(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                 const Click<Dim>& click) {
  const char* image = Dim == 3 ? "volume" : "image";
  for (const Vector<Dim>& point : points_of(click)) {
    if (point.allFinite() && extent.contains(point)) continue;
    const std::string where =
        fmt::format("Click::point_mm{}: ({}) mm is {} ({})",
                    click.side == Side::kInside ? "" : "[outside]", point_text<Dim>(point),
                    cell_word<Dim>(), index_text<Dim>(extent.in_file.world_to_index * point));
    const bool is_padded =
        IndexBox<Dim>{{}, extent.size}.n() != IndexBox<Dim>{{}, extent.in_file.size}.n();
    if (is_padded && extent.in_file.contains(point))
      throw UsageError(fmt::format(
          "{}, in the padding of the {}, which has one value and was not scanned", where, image));
    throw UsageError(fmt::format("{}, outside the {} of {} {}s; is it in another space?", where,
                                 image, fmt::join(extent.in_file.size, " x "), cell_word<Dim>()));
  }
  const bool is_inside = click.side == Side::kInside;
  if (const auto point =
          point_in_common<Dim>(extent, clicks, is_inside ? Side::kOutside : Side::kInside, click))
    throw UsageError(fmt::format(
        "Click::side: ({}) mm is in the same {} as an {} click; take one of the two away",
        point_text<Dim>(*point), cell_word<Dim>(), is_inside ? "outside" : "inside"));
}

template <int Dim>
void check_beside(const ImageExtent<Dim>& extent, const std::vector<Click<Dim>>& clicks,
                  const std::string& name, const Click<Dim>& click) {
  if (click.side != Side::kInside) return;
  if (const auto point = point_in_common<Dim>(extent, clicks, Side::kInside, click))
    throw UsageError(fmt::format(
        "Click::point_mm: ({}) mm is in the same {} as an inside click of '{}': no {} is in two "
        "objects; take one of the two away",
        point_text<Dim>(*point), cell_word<Dim>(), name, cell_word<Dim>()));
}

template <int Dim>
void check_box(const ImageExtent<Dim>& extent, const std::optional<BoxCorners<Dim>>& box_mm,
               const std::vector<Click<Dim>>& clicks) {
  if (!box_mm) return;
  const NodeBox<Dim> cells = cells_of_box(extent, *box_mm);
  for (const Click<Dim>& click : clicks) {
    if (click.side != Side::kInside) continue;
    for (const Vector<Dim>& point : points_of(click))
      if (!is_in_cells(extent, cells, point))
        throw UsageError(fmt::format("Options::box_mm: the inside click ({}) mm is outside the box",
                                     point_text<Dim>(point)));
  }
}

template <int Dim>
void check_lengths(const ImageExtent<Dim>& extent, const Options<Dim>& options) {
  const double widest = extent.diagonal_mm();
  for (const auto& [sigma, name] : {std::pair{options.sigma_mm.value_or(0), "sigma_mm"},
                                    {options.selective_sigma_mm, "selective_sigma_mm"}})
    if (sigma > widest)
      throw UsageError(
          fmt::format("Options::{} = {:.4g} mm is wider than the whole image ({:.4g} mm)", name,
                      sigma, widest));
  // In space what is as fine has more triangles than can be computed with.
  const double shortest = Dim == 2 ? kLeastEdge * extent.cell_mm() : 0;
  if (const double edge = options.edge_length_mm.value_or(shortest); edge < shortest)
    throw UsageError(
        fmt::format("Options::edge_length_mm = {:.4g} mm is less than a fiftieth of a pixel; give "
                    "{:.2g}mm or more",
                    edge, 1.05 * shortest));
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
bool contains_all(const std::vector<Click<Dim>>& clicks, const std::vector<Click<Dim>>& part) {
  return std::all_of(part.begin(), part.end(), [&](const Click<Dim>& click) {
    return std::find(clicks.begin(), clicks.end(), click) != clicks.end();
  });
}

template <int Dim>
std::vector<Click<Dim>> clicks_in_box(const ImageExtent<Dim>& extent,
                                      const std::optional<BoxCorners<Dim>>& box_mm,
                                      std::vector<Click<Dim>> clicks) {
  if (!box_mm) return clicks;
  const NodeBox<Dim> box = cells_of_box(extent, *box_mm);
  const auto is_beyond = [&](const Vector<Dim>& point) { return !is_in_cells(extent, box, point); };
  for (Click<Dim>& click : clicks) {
    std::erase_if(click.stroke_mm, is_beyond);
    if (is_beyond(click.point_mm) && !click.stroke_mm.empty())
      click.point_mm = click.stroke_mm.front();
  }
  std::erase_if(clicks, [&](const Click<Dim>& click) { return is_beyond(click.point_mm); });
  return clicks;
}

template <int Dim>
std::vector<mesh::HeldPoint<Dim>> held_points(const std::vector<Click<Dim>>& clicks) {
  std::vector<mesh::HeldPoint<Dim>> out;
  for (const Click<Dim>& click : clicks) {
    const bool is_inside = click.side == Side::kInside;
    out.push_back({click.point_mm, is_inside});
    for (const Vector<Dim>& point : click.stroke_mm) out.push_back({point, is_inside});
  }
  return out;
}

template <int Dim>
bool obeys(const Simplices<Dim>& shape, const std::vector<Click<Dim>>& clicks,
           const ImageExtent<Dim>& extent) {
  const std::vector<char> flags = mesh::are_held<Dim>(shape, held_points<Dim>(clicks),
                                                      kLeastDistance * extent.cell_mm(), extent);
  return std::all_of(flags.begin(), flags.end(), [](char flag) { return flag != 0; });
}

template <int Dim>
bool heeds(const Simplices<Dim>& shape, const std::vector<Click<Dim>>& clicks) {
  if (clicks.empty()) return true;
  std::vector<Vector<Dim>> all;
  std::vector<char> belongs;  // inside
  for (const Click<Dim>& click : clicks)
    for (const Vector<Dim>& point : points_of(click)) {
      all.push_back(point);
      belongs.push_back(click.side == Side::kInside);
    }
  Points<Dim> points(Eigen::Index(all.size()), Dim);
  for (std::size_t n = 0; n < all.size(); ++n) points.row(Eigen::Index(n)) = all[n].transpose();
  return mesh::are_inside<Dim>(shape, points) == belongs;
}

#define SURF_INSTANTIATE(Dim)                                                                      \
  template void check_click<Dim>(const ImageExtent<Dim>&, const std::vector<Click<Dim>>&,          \
                                 const Click<Dim>&);                                               \
  template void check_beside<Dim>(const ImageExtent<Dim>&, const std::vector<Click<Dim>>&,         \
                                  const std::string&, const Click<Dim>&);                          \
  template void check_lengths<Dim>(const ImageExtent<Dim>&, const Options<Dim>&);                  \
  template void check_box<Dim>(const ImageExtent<Dim>&, const std::optional<BoxCorners<Dim>>&,     \
                               const std::vector<Click<Dim>>&);                                    \
  template std::vector<Vector<Dim>> points_on<Dim>(Side, const std::vector<Click<Dim>>&);          \
  template std::vector<Click<Dim>> as_outside<Dim>(const std::vector<Click<Dim>>&);                \
  template std::vector<Click<Dim>> clicks_in_box<Dim>(                                             \
      const ImageExtent<Dim>&, const std::optional<BoxCorners<Dim>>&, std::vector<Click<Dim>>);    \
  template bool contains_all<Dim>(const std::vector<Click<Dim>>&, const std::vector<Click<Dim>>&); \
  template std::vector<mesh::HeldPoint<Dim>> held_points<Dim>(const std::vector<Click<Dim>>&);     \
  template bool obeys<Dim>(const Simplices<Dim>&, const std::vector<Click<Dim>>&,                  \
                           const ImageExtent<Dim>&);                                               \
  template bool heeds<Dim>(const Simplices<Dim>&, const std::vector<Click<Dim>>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
