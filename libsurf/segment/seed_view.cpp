#include "libsurf/segment/seed_view.h"

#include <algorithm>
#include <array>
#include <limits>

namespace surf::segment {
namespace {

constexpr double kEdgeNoise = 3;  // an edge is that many times the noise, per node
// Of the range, since phantoms have no noise: the finest step of the search.
constexpr double kLeastDeviation = 1.0 / 4096;
constexpr int kSeen = 18;  // nodes round a seed: a ball grows to 16

}  // namespace

template <int Dim>
NodeBox<Dim> cube_round(const SearchGrid<Dim>& grid, const Vector<Dim>& point, int half_width) {
  const NodeBox<Dim>& box = grid.box();
  auto lower = box.upper(), upper = box.lower;
  for (const auto& node : nearest_nodes<Dim>(grid.node_to_world().inverse() * point, box.size))
    for (int axis = 0; axis < Dim; ++axis) {
      lower[axis] = std::min(lower[axis], std::max(0, node[axis] - half_width));
      upper[axis] = std::max(upper[axis], std::min(box.size[axis], node[axis] + half_width + 1));
    }
  return NodeBox<Dim>::between(lower, upper);
}

template <int Dim>
SeedNodes<Dim> seed_nodes(const SearchGrid<Dim>& grid, const Vector<Dim>& seed) {
  const NodeBox<Dim> cube = cube_round<Dim>(grid, seed, kSeen);
  SeedNodes<Dim> out = SeedView<Dim>(grid.part(cube), std::array{seed}).seeds.front();
  for (auto& node : out.nodes)
    for (int axis = 0; axis < Dim; ++axis) node[axis] += cube.lower[axis];
  return out;
}

template <int Dim>
SeedView<Dim>::SeedView(const SearchGrid<Dim>& search_grid, std::span<const Vector<Dim>> seeds_mm)
    : grid(search_grid), deviation(std::numeric_limits<double>::infinity()) {
  for (const Vector<Dim>& seed : seeds_mm) {
    SeedNodes<Dim> here{nearest_nodes<Dim>(grid.node_to_world().inverse() * seed, grid.box().size),
                        estimate_seed_model<Dim>(grid, seed)};
    here.model.deviation = std::max(here.model.deviation, kLeastDeviation * grid.width());
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

template NodeBox<2> cube_round<2>(const SearchGrid<2>&, const Vector<2>&, int);
template NodeBox<3> cube_round<3>(const SearchGrid<3>&, const Vector<3>&, int);
template SeedNodes<2> seed_nodes<2>(const SearchGrid<2>&, const Vector<2>&);
template SeedNodes<3> seed_nodes<3>(const SearchGrid<3>&, const Vector<3>&);
template struct SeedView<2>;
template struct SeedView<3>;

}  // namespace surf::segment
