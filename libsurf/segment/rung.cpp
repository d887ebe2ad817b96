#include "libsurf/segment/rung.h"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace surf::segment {
namespace {

constexpr int kShell = 2;              // nodes, outside: what the inside is compared with
constexpr double kLeastGrowth = 0.05;  // settled regions differ by more than rungs that hardly do
constexpr int kLevels = SearchGrid<3>::kLevels;

/// Circle or ball of equal content: its length or area over the region's. A node's face counts
/// pi / 4 or 2 / 3: that is what a grid makes of a smooth curve or surface, averaged over
/// directions.
template <int Dim>
double sphericity(double n_nodes, double n_faces) {
  if constexpr (Dim == 2)
    return 2 * std::sqrt(std::numbers::pi * n_nodes) / (std::numbers::pi / 4 * n_faces);
  else
    return std::cbrt(36 * std::numbers::pi) * std::pow(n_nodes, 2.0 / 3) / (2 * n_faces / 3);
}

}  // namespace

template <int Dim>
void measure(const Flags& inside, const std::vector<std::uint16_t>& level, const Flags& edge,
             Rung<Dim>& rung) {
  const NodeBox<Dim>& box = rung.box;
  const std::vector<std::int16_t> distance = squared_distances(box, inside, kShell);
  std::vector<int> object(kLevels), shell(kLevels);
  for (std::size_t at = 0; at < box.n(); ++at)
    if (distance[at] <= kShell * kShell) ++(inside[at] ? object : shell)[level[at]];
  std::size_t n_faces = 0, n_on_edge = 0, n_on_border = 0;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      const bool is_last = here + 1 == box.size[axis];
      if (inside[at]) n_on_border += (here == 0) + is_last;
      if (is_last || inside[at] == inside[at + stride]) return;
      ++n_faces;
      n_on_edge += edge[at] || edge[at + stride];
    });
  n_faces += n_on_border;
  rung.n_nodes = std::accumulate(object.begin(), object.end(), std::size_t(0));
  if (rung.n_nodes == 0) return;
  rung.border_share = double(n_on_border) / double(n_faces);
  rung.features.separation = histogram_separation(object, shell);
  rung.features.edge_share = double(n_on_edge) / double(n_faces);
  rung.features.sphericity = sphericity<Dim>(double(rung.n_nodes), double(n_faces));
}

template <int Dim>
double ladder_score(const Rung<Dim>& rung) {
  return rung.features.score() * std::pow(rung.features.separation, 0.3) *
         std::pow(double(rung.n_nodes), 0.09 / Dim) * std::exp(-rung.border_share);
}

template <int Dim>
double boundary_score(const Rung<Dim>& rung) {
  if (rung.n_nodes == 0) return 0;
  const RungFeatures& f = rung.features;
  return std::pow(f.separation, 1.5) * f.edge_share *
         std::pow(std::clamp(f.sphericity, 0.0, 1.0), 0.15) *
         std::pow(double(rung.n_nodes), 0.2 / Dim) * std::exp(-rung.border_share);
}

template <int Dim>
double settled_score(const Rung<Dim>& rung, double depth_share) {
  const RungFeatures& f = rung.features;
  const double of_family = rung.family == Family::kAlike      ? 1
                           : rung.family == Family::kBrighter ? 0.9
                           : rung.family == Family::kCut      ? 1
                                                              : 0.55;
  return boundary_score(rung) * of_family * std::pow(std::max(f.growth_out, kLeastGrowth), 0.75) *
         std::exp(-f.growth_in / 5) * std::pow(depth_share, 0.6);
}

template <int Dim>
double overlap(const Rung<Dim>& a, const Rung<Dim>& b) {
  std::size_t n_both = 0;
  for (std::size_t at = 0; at < a.inside.size(); ++at) {
    if (!a.inside[at]) continue;
    const auto node = a.box.node(at);
    n_both += b.box.contains(node) && b.inside[b.box.at(node)];
  }
  return 2 * double(n_both) / double(a.n_nodes + b.n_nodes);
}

template <int Dim>
std::vector<const Rung<Dim>*> differing(std::vector<const Rung<Dim>*> rungs, std::size_t n_most,
                                        double most_overlap) {
  std::stable_sort(rungs.begin(), rungs.end(),
                   [](const auto* a, const auto* b) { return a->score > b->score; });
  std::vector<const Rung<Dim>*> out;
  for (const Rung<Dim>* rung : rungs) {
    if (out.size() == n_most || !(rung->score > 0)) break;
    if (std::none_of(out.begin(), out.end(), [&](const Rung<Dim>* other) {
          const double fewer = double(std::min(rung->n_nodes, other->n_nodes)),
                       both = double(rung->n_nodes + other->n_nodes);
          return 2 * fewer > most_overlap * both && overlap(*rung, *other) > most_overlap;
        }))
      out.push_back(rung);
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                               \
  template void measure<Dim>(const Flags&, const std::vector<std::uint16_t>&, const Flags&, \
                             Rung<Dim>&);                                                   \
  template double ladder_score<Dim>(const Rung<Dim>&);                                      \
  template double boundary_score<Dim>(const Rung<Dim>&);                                    \
  template double settled_score<Dim>(const Rung<Dim>&, double);                             \
  template double overlap<Dim>(const Rung<Dim>&, const Rung<Dim>&);                         \
  template std::vector<const Rung<Dim>*> differing<Dim>(std::vector<const Rung<Dim>*>,      \
                                                        std::size_t, double);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
