#include "libsurf/segment/detail/majority.h"

#include <numeric>
#include <vector>

namespace surf::segment {

template <int Dim>
NodeSet<Dim> majority(std::span<const NodeSet<Dim>* const> sets, std::span<const double> weights) {
  if (sets.empty()) return {};
  const NodeBox<Dim>& box = sets.front()->box();
  std::vector<double> votes(box.n(), 0);
  for (std::size_t n = 0; n < sets.size(); ++n)
    sets[n]->for_each([&](std::size_t at) { votes[at] += weights[n]; });
  const double half = std::accumulate(weights.begin(), weights.end(), 0.0) / 2;
  return NodeSet<Dim>::where(box, [&](std::size_t at) { return votes[at] > half; });
}

#define SURF_INSTANTIATE(Dim)                                               \
  template NodeSet<Dim> majority<Dim>(std::span<const NodeSet<Dim>* const>, \
                                      std::span<const double>);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
