#include "libsurf/segment/change.h"

#include <algorithm>
#include <bit>
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

ChangedNodes changed_nodes(const Flags& a, const Flags& b) {
  ChangedNodes out;
  out.bits.assign((a.size() + 63) / 64, 0);
  for (std::size_t at = 0; at < a.size(); ++at)
    out.bits[at / 64] |= std::uint64_t(a[at] != b[at]) << at % 64;
  for (const std::uint64_t word : out.bits) out.n += std::popcount(word);
  return out;
}

double ChangedNodes::dice(const ChangedNodes& other) const {
  double both = 0;
  for (std::size_t w = 0; w < bits.size(); ++w) both += std::popcount(bits[w] & other.bits[w]);
  return 2 * both / std::max(1.0, n + other.n);
}

template <int Dim>
ChangeFeatures measure_change(const NodeBox<Dim>& box, const Flags& piece, const Flags& before,
                              Side side, const std::vector<std::uint16_t>& level,
                              const Flags& edge) {
  const bool adds = side == Side::kInside;
  ChangeFeatures out;
  Flags at_free(piece.size(), 0);
  for (std::size_t at = 0; at < piece.size(); ++at) out.n_nodes += piece[at];
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      const bool is_last = here + 1 == box.size[axis];
      if (piece[at]) {
        const int n_border = (here == 0) + is_last;
        out.n_border += n_border;
        out.n_faces += n_border;
      }
      if (is_last || piece[at] == piece[at + stride]) return;
      ++out.n_faces;
      const std::size_t beyond = piece[at] ? at + stride : at;
      if (adds == bool(before[beyond])) return;  // the seam
      ++out.n_free;
      out.n_free_on_edge += edge[at] || edge[at + stride];
      at_free[piece[at] ? at : at + stride] = 1;
    });
  const std::vector<std::int16_t> to_free = squared_distances(box, at_free, kShell);
  std::vector<int> inner(kLevels), outer(kLevels);
  for (std::size_t at = 0; at < piece.size(); ++at)
    if (piece[at])
      ++inner[level[at]];
    else if (to_free[at] <= kShell * kShell && adds != bool(before[at]))
      ++outer[level[at]];
  out.separation = histogram_separation(inner, outer);
  return out;
}

template <int Dim>
std::size_t largest_component(const NodeBox<Dim>& box, const Flags& flags) {
  Flags left = flags;
  std::size_t largest = 0;
  std::vector<std::size_t> front;
  for (std::size_t at = 0; at < left.size(); ++at) {
    if (!left[at]) continue;
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
      const auto node = box.node(here);
      std::size_t stride = 1;
      for (int axis = 0; axis < Dim; stride *= box.size[axis], ++axis) {
        if (node[axis] > box.lower[axis]) enter(here - stride);
        if (node[axis] + 1 < box.lower[axis] + box.size[axis]) enter(here + stride);
      }
    }
    largest = std::max(largest, n);
  }
  return largest;
}

double Depths::share(double of_greatest) const {
  return std::min(1.0, (at_nodes + kSlack) / (of_greatest * std::max(greatest, 1.0)));
}

template <int Dim>
Depths depths_of(const NodeBox<Dim>& grid, const NodeBox<Dim>& box, const Flags& inside,
                 std::span<const typename NodeBox<Dim>::Index> nodes) {
  Flags outside(inside.size());
  std::transform(inside.begin(), inside.end(), outside.begin(),
                 [](std::uint8_t flag) { return std::uint8_t(!flag); });
  std::vector<float> squared = exact_squared_distances(box, outside);
  for (int axis = 0; axis < Dim; ++axis) {
    if (has_few_slices(grid, axis)) continue;
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
      const int node = box.lower[axis] + here - grid.lower[axis];
      const auto to_border = float(std::min(node + 1, grid.size[axis] - node));
      squared[at] = std::min(squared[at], to_border * to_border);
    });
  }
  Depths out;
  for (std::size_t at = 0; at < squared.size(); ++at)
    if (inside[at] && std::isfinite(squared[at]))
      out.greatest = std::max(out.greatest, std::sqrt(double(squared[at])));
  for (const auto& node : nodes)
    if (box.contains(node) && inside[box.at(node)] && std::isfinite(squared[box.at(node)]))
      out.at_nodes = std::max(out.at_nodes, std::sqrt(double(squared[box.at(node)])));
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template ChangeFeatures measure_change<Dim>(const NodeBox<Dim>&, const Flags&, const Flags&, \
                                              Side, const std::vector<std::uint16_t>&,         \
                                              const Flags&);                                   \
  template std::size_t largest_component<Dim>(const NodeBox<Dim>&, const Flags&);              \
  template Depths depths_of<Dim>(const NodeBox<Dim>&, const NodeBox<Dim>&, const Flags&,       \
                                 std::span<const NodeBox<Dim>::Index>);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
