#include "libsurf/segment/seed_view.h"

#include <algorithm>
#include <limits>

namespace surf::segment {
namespace {

constexpr double kEdgeNoise = 3;  // an edge is that many times the noise, per node
// Of the range, since phantoms have no noise: the finest step of the search.
constexpr double kLeastDeviation = 1.0 / 4096;

}  // namespace

template <int Dim>
SeedView<Dim>::SeedView(const SearchGrid<Dim>& search_grid, std::span<const Vector<Dim>> seeds_mm)
    : grid(search_grid), deviation(std::numeric_limits<double>::infinity()) {
  for (const Vector<Dim>& seed : seeds_mm) {
    SeedNodes<Dim> here{nearest_nodes<Dim>(grid.node_to_world().inverse() * seed, grid.box().size),
                        estimate_seed_model<Dim>(grid, seed)};
    here.model.deviation = std::max(here.model.deviation, kLeastDeviation * grid.range());
    noise = std::max(noise, here.model.noise);
    deviation = std::min(deviation, here.model.deviation);
    seeds.push_back(std::move(here));
  }
  flag_edges();
}

template <int Dim>
SeedView<Dim>::SeedView(const SearchGrid<Dim>& search_grid, std::vector<SeedNodes<Dim>> known,
                        double noise_of_seeds)
    : grid(search_grid),
      seeds(std::move(known)),
      noise(noise_of_seeds),
      deviation(std::numeric_limits<double>::infinity()) {
  for (const SeedNodes<Dim>& seed : seeds) deviation = std::min(deviation, seed.model.deviation);
  flag_edges();
}

template <int Dim>
void SeedView<Dim>::flag_edges() {
  const double least = kEdgeNoise * noise / grid.node_mm();
  edge = NodeSet<Dim>::where(grid.box(),
                             [&](std::size_t at) { return grid.edge_slope()[at] > least; });
}

template <int Dim>
std::vector<typename NodeBox<Dim>::Index> SeedView<Dim>::starts(const NodeSet<Dim>& nodes,
                                                                int reach) const {
  const auto around = NodeBox<Dim>::cube(-reach, 2 * reach + 1);
  std::vector<typename NodeBox<Dim>::Index> out;
  for (const SeedNodes<Dim>& seed : seeds) {
    int nearest = reach * reach;
    std::vector<typename NodeBox<Dim>::Index> found;
    for (const auto& center : seed.nodes)
      for (std::size_t at = 0; at < around.n(); ++at) {
        auto node = around.node(at);
        int squared = 0;
        for (int axis = 0; axis < Dim; ++axis) {
          squared += node[axis] * node[axis];
          node[axis] += center[axis];
        }
        if (squared > nearest || !nodes.contains(node)) continue;
        if (squared < nearest) found.clear();
        nearest = squared;
        found.push_back(node);
      }
    out.insert(out.end(), found.begin(), found.end());
  }
  return out;
}

template struct SeedView<2>;
template struct SeedView<3>;

}  // namespace surf::segment
