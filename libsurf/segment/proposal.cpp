#include "libsurf/segment/proposal.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "libsurf/base/names.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/object_box.h"

namespace surf::segment {
namespace {

/// The shape ended at the outer faces of the cells where it leaves the box of their centres;
/// vertices that come to the same place there, at its corners and edges, become one.
/// @param depth  of the outermost nodes below the faces, in cells: beside an edge of the box the
///               shape of a level ends on its faces so far from it, and cuts it off. What lies on
///               one of two such faces goes to the edge; less than 0: it stays cut off
template <int Dim>
Simplices<Dim> in_box(
    const ImageExtent<Dim>& extent, const Simplices<Dim>& shape,
    const Eigen::Array<double, Dim, 1>& depth = Eigen::Array<double, Dim, 1>::Constant(-1)) {
  using Array = Eigen::Array<double, Dim, 1>;
  Array last;
  for (int axis = 0; axis < Dim; ++axis) last[axis] = extent.size[axis] - 1;
  std::map<std::array<double, Dim>, int> moved;  // indices of the box's border
  std::vector<Vector<Dim>> points;
  std::vector<int> vertex(shape.points.rows());
  for (Eigen::Index i = 0; i < shape.points.rows(); ++i) {
    const Array index = (extent.world_to_index * shape.points.row(i).transpose()).array();
    vertex[i] = int(points.size());
    if ((index >= 0 && index <= last).all()) {
      points.push_back(shape.points.row(i).transpose());
      continue;
    }
    // Rounded, so that places that differ by rounding alone are one.
    Array ended = (index < 0).select(extent.first(), (index > last).select(extent.last(), index));
    for (int axis = 0; axis < Dim; ++axis) {
      if (index[axis] >= 0 && index[axis] <= last[axis]) continue;
      for (int other = 0; other < axis; ++other) {
        if (index[other] <= extent.first()[other] + depth[other])
          ended[other] = extent.first()[other];
        if (index[other] >= extent.last()[other] - depth[other])
          ended[other] = extent.last()[other];
      }
    }
    const Array at = (ended * 1e6).round() / 1e6;
    std::array<double, Dim> key;
    std::copy(at.begin(), at.end(), key.begin());
    const auto [known, is_new] = moved.try_emplace(key, vertex[i]);
    vertex[i] = known->second;
    if (is_new) points.push_back(extent.index_to_world * at.matrix());
  }
  std::vector<std::array<int, Dim>> elements;
  for (const auto element : shape.elements.rowwise()) {
    std::array<int, Dim> corners;
    for (int c = 0; c < Dim; ++c) corners[c] = vertex[element[c]];
    std::array<int, Dim> sorted = corners;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end())
      elements.push_back(corners);
  }
  Simplices<Dim> out;
  out.points.resize(Eigen::Index(points.size()), Dim);
  for (std::size_t i = 0; i < points.size(); ++i) out.points.row(Eigen::Index(i)) = points[i];
  out.elements.resize(Eigen::Index(elements.size()), Dim);
  for (std::size_t i = 0; i < elements.size(); ++i)
    for (int c = 0; c < Dim; ++c) out.elements(Eigen::Index(i), c) = elements[i][c];
  return out;
}

template <int Dim>
bool is_sound(const Setting<Dim>& setting, const Simplices<Dim>& shape) {
  if constexpr (Dim == 3) return mesh::verify(shape).passed();
  return shape.elements.rows() > 0 && setting.is_embedded(shape);
}

/// Where a region's share is one half; of whole nodes, with stairs, if the smooth shape does not
/// pass; nothing if that does not either.
template <int Dim>
std::optional<Simplices<Dim>> boundary(const Setting<Dim>& setting, const Region<Dim>& region) {
  constexpr double kRounding = 1e-6;
  std::vector<float> values = region.share;
  const Eigen::Array<double, Dim, 1> half_nodes =
      (setting.extent().world_to_index.linear() * region.node_to_world.linear())
          .diagonal()
          .cwiseAbs()
          .array() /
      2;
  for (const bool is_smooth : {true, false}) {
    if (!is_smooth)
      for (float& value : values) value = value > 0.5f ? 1.f : 0.f;
    const Simplices<Dim> level =
        setting.shape_of_level(values, region.size, region.node_to_world, 0.5);
    for (const bool is_sharp : {true, false}) {
      Simplices<Dim> out = is_sharp ? in_box<Dim>(setting.extent(), level, half_nodes + kRounding)
                                    : in_box<Dim>(setting.extent(), level);
      if (is_sound<Dim>(setting, out)) return out;
    }
  }
  return std::nullopt;
}

/// What a further click has changed.
const char* change_words(Family family) {
  using enum Family;
  return name_of(family, {{kAlike, "what is alike"},
                          {kBrighter, "what is brighter"},
                          {kDarker, "what is darker"},
                          {kBetween, "what lies between the clicks' intensities"},
                          {kFront, "what is reached before an edge"},
                          {kCompetition, "what is nearer to it than to the others"},
                          {kNeck, "what a neck parts from the others"},
                          {kBall, "what is close to it"},
                          {kCut, "a least cut between all"}});
}

}  // namespace

template <int Dim>
SearchGrid<Dim> search_grid(const Setting<Dim>& setting, FieldOptions options,
                            std::optional<double> sigma_mm,
                            const std::optional<BoxCorners<Dim>>& box_mm, double max_nodes) {
  std::optional<NodeBox<Dim>> cells;
  if (box_mm) cells = cells_of_box(setting.extent(), *box_mm);
  const SearchLattice<Dim> lattice(setting.extent(), max_nodes, cells);
  options.smoothing.sigma_mm = sigma_mm.value_or(lattice.sigma_mm);
  return {setting.rough_intensity(options), setting.extent(), lattice};
}

template <int Dim>
Simplices<Dim> boundary(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                        const NodeSet<Dim>& nodes) {
  constexpr int kMargin = 6;  // nodes: the blur of shares() has come to its end
  const NodeSet<Dim> inside = nodes.in(nodes.bounds(kMargin));
  const NodeBox<Dim>& box = inside.box();
  Vector<Dim> lower;
  for (int axis = 0; axis < Dim; ++axis) lower[axis] = box.lower[axis];
  return in_box<Dim>(
      setting.extent(),
      setting.shape_of_level(shares(inside), box.size,
                             grid.node_to_world() * Eigen::Translation<double, Dim>(lower), 0.5));
}

template <int Dim>
Simplices<Dim> preview(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                       const Rung<Dim>& rung) {
  const NodeBox<Dim>& box = rung.inside.box();
  Vector<Dim> lower;
  for (int axis = 0; axis < Dim; ++axis) lower[axis] = box.lower[axis];
  return setting.shape_of_level(shares(rung.inside), box.size,
                                grid.node_to_world() * Eigen::Translation<double, Dim>(lower), 0.5);
}

template <int Dim>
std::vector<Proposal<Dim>> proposals(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                     const ClickSearch<Dim>& search) {
  const std::vector<Region<Dim>> found = regions(grid, search);
  std::vector<std::optional<Simplices<Dim>>> shapes(found.size());
  tbb::parallel_for(std::size_t(0), found.size(),
                    [&](std::size_t n) { shapes[n] = boundary<Dim>(setting, found[n]); });
  std::vector<Proposal<Dim>> out;
  for (std::size_t n = 0; n < found.size(); ++n) {
    const Region<Dim>& region = found[n];
    std::optional<Simplices<Dim>>& shape = shapes[n];
    if (!shape) continue;
    const double enclosed = fem::Geometry<Dim>(shape->points, shape->elements).enclosed();
    out.push_back({std::move(*shape), region.score, enclosed, region.family,
                   0.5 * (region.low + region.high), 0.5 * (region.high - region.low),
                   region.neck_radius_mm, region.node_mm, region.features, n,
                   search.clicks.size()});
  }
  return out;
}

template <int Dim>
std::string to_string(const Proposal<Dim>& proposal) {
  const double low = proposal.mean - proposal.half_width,
               high = proposal.mean + proposal.half_width;
  if (proposal.n_clicks > 1)
    return fmt::format(
        "what {} clicks leave, changed last by {}, nearly all intensities between {:.4g} and "
        "{:.4g}, settled on the edges near by; score {:.2f}",
        proposal.n_clicks, change_words(proposal.family), low, high, proposal.score);
  std::string what;
  bool has_necks = true;
  switch (proposal.family) {
    case Family::kAlike:
      what = fmt::format("intensities between {:.4g} and {:.4g}", low, high);
      break;
    case Family::kBrighter:
      what = fmt::format("intensities above {:.4g}, nearly all below {:.4g}", low, high);
      break;
    case Family::kCut:
      has_necks = false;
      what = fmt::format(
          "what a least cut parts from the box, nearly all intensities between {:.4g} and {:.4g}",
          low, high);
      break;
    default:
      what = fmt::format(
          "what is reached before an edge, nearly all intensities between {:.4g} and {:.4g}", low,
          high);
      break;
  }
  if (has_necks)
    what += fmt::format(", cut off where a neck is thinner than {:.3g} mm",
                        2 * proposal.neck_radius_mm);
  return fmt::format("{}, settled on the edges near by; score {:.2f}", what, proposal.score);
}

#define SURF_INSTANTIATE(Dim)                                                                     \
  template std::string to_string<Dim>(const Proposal<Dim>&);                                      \
  template SearchGrid<Dim> search_grid<Dim>(const Setting<Dim>&, FieldOptions,                    \
                                            std::optional<double>,                                \
                                            const std::optional<BoxCorners<Dim>>&, double);       \
  template Simplices<Dim> boundary<Dim>(const Setting<Dim>&, const SearchGrid<Dim>&,              \
                                        const NodeSet<Dim>&);                                     \
  template Simplices<Dim> preview<Dim>(const Setting<Dim>&, const SearchGrid<Dim>&,               \
                                       const Rung<Dim>&);                                         \
  template std::vector<Proposal<Dim>> proposals<Dim>(const Setting<Dim>&, const SearchGrid<Dim>&, \
                                                     const ClickSearch<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
