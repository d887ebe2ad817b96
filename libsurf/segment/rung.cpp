#include "libsurf/segment/rung.h"

#include <algorithm>
#include <numbers>
#include <numeric>

namespace surf::segment {
namespace {

constexpr int kShell = 2;              // nodes, outside: what the inside is compared with
constexpr double kLeastGrowth = 0.05;  // settled regions differ by more than rungs that hardly do
constexpr int kLevels = SearchGrid<3>::kLevels;
constexpr double kMostGrowthOfSettling = 30;  // of a ball of 3 nodes ten

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

/// What family and growth say.
template <int Dim>
double of_ladder(const Rung<Dim>& rung) {
  const RungFeatures& f = rung.features;
  const double of_family = rung.family == Family::kAlike      ? 1
                           : rung.family == Family::kBrighter ? 0.9
                           : rung.family == Family::kCut      ? 1
                                                              : 0.55;
  return of_family * std::pow(std::max(f.growth_out, kLeastGrowth), 0.75) *
         std::exp(-f.growth_in / 5);
}

}  // namespace

template <int Dim>
void measure(const NodeBox<Dim>& grid, const std::vector<std::uint16_t>& level,
             const NodeSet<Dim>& edge, Rung<Dim>& rung) {
  const NodeSet<Dim>& inside = rung.inside;
  rung.n_nodes = inside.count();
  if (rung.n_nodes == 0) return;
  std::size_t n_border = 0;
  for (int axis = 0; axis < Dim; ++axis)
    n_border +=
        inside.count_in_layer(axis, 0) + inside.count_in_layer(axis, inside.box().size[axis] - 1);
  const NodeSet<Dim> on_edge = edge.in(inside.box());
  std::size_t n_faces = n_border, n_on_edge = 0;
  for (int axis = 0; axis < Dim; ++axis) {
    const NodeSet<Dim> faces = inside.faces_along(axis);
    n_faces += faces.count();
    n_on_edge += (faces & (on_edge | on_edge.next_along(axis))).count();
  }
  std::vector<int> object(kLevels), shell(kLevels);
  inside.for_each_in(grid, [&](std::size_t at) { ++object[level[at]]; });
  (inside.dilated(kShell) - inside).for_each_in(grid, [&](std::size_t at) { ++shell[level[at]]; });
  rung.border_share = double(n_border) / double(n_faces);
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
  return boundary_score(rung) * of_ladder(rung) * std::pow(depth_share, 0.6);
}

template <int Dim>
double most_settled_score(const Rung<Dim>& rung) {
  Rung<Dim> best = rung;
  best.n_nodes = std::size_t(kMostGrowthOfSettling * double(rung.n_nodes));
  best.features.separation = best.features.edge_share = best.features.sphericity = 1;
  best.border_share = 0;
  return settled_score(best, 1);
}

template <int Dim>
double overlap(const Rung<Dim>& a, const Rung<Dim>& b) {
  const std::size_t both = (a.inside & b.inside.in(a.inside.box())).count();
  return 2 * double(both) / double(a.n_nodes + b.n_nodes);
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

#define SURF_INSTANTIATE(Dim)                                                          \
  template void measure<Dim>(const NodeBox<Dim>&, const std::vector<std::uint16_t>&,   \
                             const NodeSet<Dim>&, Rung<Dim>&);                         \
  template double ladder_score<Dim>(const Rung<Dim>&);                                 \
  template double boundary_score<Dim>(const Rung<Dim>&);                               \
  template double settled_score<Dim>(const Rung<Dim>&, double);                        \
  template double most_settled_score<Dim>(const Rung<Dim>&);                           \
  template double overlap<Dim>(const Rung<Dim>&, const Rung<Dim>&);                    \
  template std::vector<const Rung<Dim>*> differing<Dim>(std::vector<const Rung<Dim>*>, \
                                                        std::size_t, double);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
