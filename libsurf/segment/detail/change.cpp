#include "libsurf/segment/detail/change.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surf::segment {
namespace {

constexpr int kShell = 2;       // nodes beyond the new boundary: what the piece is compared with
constexpr double kSlack = 0.7;  // nodes
constexpr double kSeparation = 1.3, kLeastSeparation = 0.6;
constexpr int kLevels = SearchGrid<3>::kLevels;

}  // namespace

double ChangeFeatures::score(Side side) const {
  if (n_faces == 0) return 0;
  if (side == Side::kInside)
    return std::pow(separation, kSeparation) * (n_free_on_edge + 0.5) / (n_free + 1) *
           std::exp(-n_border / n_faces);
  const double off_edge = (n_free - n_free_on_edge) / n_faces;
  return (1 - off_edge) * (1 - off_edge) *
         std::pow(std::max(separation, kLeastSeparation), kSeparation);
}

template <int Dim>
ChangeFeatures measure_change(const NodeBox<Dim>& grid, const NodeSet<Dim>& piece,
                              const NodeSet<Dim>& before, Side side,
                              const std::vector<std::uint16_t>& level, const NodeSet<Dim>& edge) {
  const NodeBox<Dim>& box = piece.box();
  const NodeSet<Dim> object = before.in(box), on_edge = edge.in(box),
                     open = side == Side::kInside ? object.complement() : object;
  ChangeFeatures out;
  out.n_nodes = double(piece.count());
  NodeSet<Dim> at_free(box);
  for (int axis = 0; axis < Dim; ++axis) {
    const auto n_border =
        double(piece.count_in_layer(axis, 0) + piece.count_in_layer(axis, box.size[axis] - 1));
    out.n_border += n_border;
    const NodeSet<Dim> faces = piece.faces_along(axis);
    out.n_faces += double(faces.count()) + n_border;
    // The others are the seam.
    const NodeSet<Dim> free = (faces & piece & open.next_along(axis)) | ((faces - piece) & open);
    out.n_free += double(free.count());
    out.n_free_on_edge += double((free & (on_edge | on_edge.next_along(axis))).count());
    at_free |= (free | free.previous_along(axis)) & piece;
  }
  std::vector<int> inner(kLevels), outer(kLevels);
  piece.for_each_in(grid, [&](std::size_t at) { ++inner[level[at]]; });
  ((at_free.dilated(kShell) & open) - piece).for_each_in(grid, [&](std::size_t at) {
    ++outer[level[at]];
  });
  out.separation = histogram_separation(inner, outer);
  return out;
}

template <int Dim>
std::size_t largest_component(const NodeSet<Dim>& nodes) {
  const NodeBox<Dim>& box = nodes.box();
  Flags left = nodes.flags();
  std::size_t largest = 0;
  std::vector<std::size_t> front;
  nodes.for_each([&](std::size_t at) {
    if (!left[at]) return;
    std::size_t n = 0;
    const auto enter = [&](std::size_t next) {
      if (!left[next]) return;
      left[next] = 0;
      ++n;
      front.push_back(next);
    };
    enter(at);
    while (!front.empty()) {
      const std::size_t here = front.back();
      front.pop_back();
      box.for_neighbours(here, enter);
    }
    largest = std::max(largest, n);
  });
  return largest;
}

double Depths::share(double of_greatest) const {
  return std::min(1.0, (at_nodes + kSlack) / (of_greatest * std::max(greatest, 1.0)));
}

template <int Dim>
Depths depths_of(const NodeBox<Dim>& grid, const NodeSet<Dim>& inside,
                 std::span<const typename NodeBox<Dim>::Index> nodes) {
  const NodeBox<Dim>& box = inside.box();
  std::vector<float> squared = exact_squared_distances(box, inside.complement().flags());
  for (int axis = 0; axis < Dim; ++axis) {
    if (has_few_slices(grid, axis)) continue;
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
      const int node = box.lower[axis] + here - grid.lower[axis];
      const auto to_border = float(std::min(node + 1, grid.size[axis] - node));
      squared[at] = std::min(squared[at], to_border * to_border);
    });
  }
  Depths out;
  inside.for_each([&](std::size_t at) {
    if (std::isfinite(squared[at]))
      out.greatest = std::max(out.greatest, std::sqrt(double(squared[at])));
  });
  for (const auto& node : nodes)
    if (inside.contains(node) && std::isfinite(squared[box.at(node)]))
      out.at_nodes = std::max(out.at_nodes, std::sqrt(double(squared[box.at(node)])));
  return out;
}

namespace {

constexpr int kCell = 4;  // nodes along each axis

/// No more than the depth of the deepest node.
template <int Dim>
double least_greatest(const NodeSet<Dim>& inside) {
  const NodeBox<Dim>& box = inside.box();
  NodeBox<Dim> cells;
  std::size_t n_in_cell = 1;
  for (int axis = 0; axis < Dim; ++axis) {
    cells.size[axis] = (box.size[axis] + kCell - 1) / kCell + 2;  // one beyond the box on each side
    n_in_cell *= kCell;
  }
  std::vector<std::uint8_t> n_inside(cells.n(), 0);  // at most 64
  inside.for_each([&](std::size_t at) {
    auto node = box.node(at);
    for (int axis = 0; axis < Dim; ++axis) node[axis] = (node[axis] - box.lower[axis]) / kCell + 1;
    ++n_inside[cells.at(node)];
  });
  Flags is_open(cells.n());
  for (std::size_t at = 0; at < is_open.size(); ++at) is_open[at] = n_inside[at] < n_in_cell;
  const std::vector<float> squared = exact_squared_distances(cells, is_open);
  float greatest = 0;
  for (const float value : squared)
    if (std::isfinite(value)) greatest = std::max(greatest, value);
  // What is outside is half a diagonal at most from the centre of its cell, as is a node from that
  // of its own.
  return kCell * std::sqrt(double(greatest)) - (kCell - 1) * std::sqrt(double(Dim));
}

/// No less than the depth of a node.
template <int Dim>
double most_depth(const NodeSet<Dim>& inside, const typename NodeBox<Dim>::Index& node) {
  int least = std::numeric_limits<int>::max();
  for (int axis = 0; axis < Dim; ++axis)
    for (const int step : {-1, 1}) {
      auto at = node;
      int n = 0;
      while (inside.box().contains(at) && inside.contains(at)) {
        at[axis] += step;
        ++n;
      }
      if (inside.box().contains(at)) least = std::min(least, n);
    }
  return least;
}

}  // namespace

template <int Dim>
double most_share(const NodeSet<Dim>& inside, std::span<const typename NodeBox<Dim>::Index> nodes) {
  Depths out{0, least_greatest(inside)};
  for (const auto& node : nodes)
    if (inside.contains(node)) out.at_nodes = std::max(out.at_nodes, most_depth(inside, node));
  return out.share();
}

#define SURF_INSTANTIATE(Dim)                                              \
  template ChangeFeatures measure_change<Dim>(                             \
      const NodeBox<Dim>&, const NodeSet<Dim>&, const NodeSet<Dim>&, Side, \
      const std::vector<std::uint16_t>&, const NodeSet<Dim>&);             \
  template std::size_t largest_component<Dim>(const NodeSet<Dim>&);        \
  template Depths depths_of<Dim>(const NodeBox<Dim>&, const NodeSet<Dim>&, \
                                 std::span<const NodeBox<Dim>::Index>);    \
  template double most_share<Dim>(const NodeSet<Dim>&, std::span<const NodeBox<Dim>::Index>);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
