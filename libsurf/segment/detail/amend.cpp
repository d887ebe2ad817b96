#include "libsurf/segment/detail/amend.h"

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/segment/proposal.h"

namespace surf::segment {
namespace {

// Evolving anew takes 1.4 times as long as a part at 4,000 triangles, 1.5 to 2 times at 10,000.
template <int Dim>
constexpr Eigen::Index kLarge = Dim == 3 ? 8000 : 1000;  // triangles, segments
// Of the larger region: beyond, all of the shape evolves anew.
constexpr double kMostChange = 0.5;
constexpr double kBeyondReach = 1.5;  // nodes: by which shells overlap the shape further
// Where the shape moves again, round the change and the clicks: nodes, and wanted edge lengths.
constexpr double kRegionNodes = 2, kRegionEdges = 2;

template <int Dim>
struct Shells {
  NodeSet<Dim> added, gone;
};

/// Regions that overlap what is there, but not along its boundary: there two sheets would lie on
/// each other.
template <int Dim>
Shells<Dim> shells(const NodeSet<Dim>& before, const NodeSet<Dim>& after, double overlap) {
  const NodeSet<Dim> added = after - before, gone = before - after;
  const NodeSet<Dim> core = before - before.complement().dilated(1);
  return {added | (added.dilated(overlap) & core),
          gone | (gone.dilated(overlap) - after.dilated(1))};
}

template <int Dim>
void add_points(const Simplices<Dim>& shape, mesh::Neighbourhood<Dim>& region) {
  for (const auto& point : shape.points.rowwise()) region.add(point.transpose());
}

}  // namespace

template <int Dim>
bool is_amended(const Simplices<Dim>& settled) {
  return settled.elements.rows() >= kLarge<Dim>;
}

template <int Dim>
std::optional<Amended<Dim>> amended(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                    const Amendment<Dim>& amendment,
                                    mesh::MovingShapeOptions<Dim> options) {
  const NodeSet<Dim>&before = amendment.before, &after = amendment.after;
  const std::size_t n_changed = (before ^ after).count();
  if (double(n_changed) > kMostChange * double(std::max(before.count(), after.count())))
    return std::nullopt;
  const double node = grid.node_mm();
  const Shells<Dim> change = shells<Dim>(before, after, amendment.reach_mm / node + kBeyondReach);
  auto region = std::make_shared<mesh::Neighbourhood<Dim>>(
      std::max(kRegionNodes * node, kRegionEdges * options.edge_length_mm));
  std::vector<Simplices<Dim>> parts = {amendment.shape};
  if (!change.added.is_empty()) {
    parts.push_back(boundary<Dim>(setting, grid, change.added));
    add_points<Dim>(parts.back(), *region);
  }
  if (!change.gone.is_empty()) {
    parts.push_back(setting.flipped(boundary<Dim>(setting, grid, change.gone)));
    add_points<Dim>(parts.back(), *region);
  }
  for (const Click<Dim>& click : amendment.clicks) {
    region->add(click.point_mm);
    for (const Vector<Dim>& point : click.stroke_mm) region->add(point);
  }
  options.region = region;
  Amended<Dim> out;
  try {
    out.shape = setting.make_shape(setting.joined(parts), options)->simplices();
  } catch (const InvalidMesh&) {
    return std::nullopt;
  }
  if (out.shape.elements.rows() == 0 || !setting.is_embedded(out.shape)) return std::nullopt;
  out.region = std::move(region);
  out.changed = double(n_changed) * std::pow(node, Dim);
  return out;
}

template bool is_amended<2>(const Segments&);
template bool is_amended<3>(const Triangles&);
template std::optional<Amended<2>> amended<2>(const Setting<2>&, const SearchGrid<2>&,
                                              const Amendment<2>&, mesh::MovingShapeOptions<2>);
template std::optional<Amended<3>> amended<3>(const Setting<3>&, const SearchGrid<3>&,
                                              const Amendment<3>&, mesh::MovingShapeOptions<3>);

}  // namespace surf::segment
