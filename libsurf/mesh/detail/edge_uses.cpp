#include "libsurf/mesh/detail/edge_uses.h"

#include <algorithm>
#include <tuple>

#include "libsurf/base/disjoint_sets.h"

namespace surf::mesh {

std::vector<EdgeUse> edge_uses(const Elements<3>& elements) {
  std::vector<EdgeUse> uses;
  uses.reserve(elements.size());
  for (int row = 0; row < elements.rows(); ++row)
    for (int corner = 0; corner < 3; ++corner) {
      const int from = elements(row, corner), to = elements(row, (corner + 1) % 3);
      uses.push_back({std::min(from, to), std::max(from, to), row, corner, from < to});
    }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.element, a.corner) <
           std::tie(b.low, b.high, b.element, b.corner);
  });
  return uses;
}

Components components(const std::vector<EdgeUse>& uses, Eigen::Index n_elements) {
  DisjointSets sets(n_elements);
  for (std::size_t i = 1; i < uses.size(); ++i)
    if (uses[i].low == uses[i - 1].low && uses[i].high == uses[i - 1].high)
      sets.join(uses[i - 1].element, uses[i].element);
  Components result;
  result.of_element.assign(n_elements, 0);
  std::vector<int> number(n_elements, -1);
  for (int row = 0; row < n_elements; ++row) {
    int& of_root = number[sets.find(row)];
    if (of_root < 0) of_root = result.n++;
    result.of_element[row] = of_root;
  }
  return result;
}

}  // namespace surf::mesh
