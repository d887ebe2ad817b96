#include "libsurf/mesh/detail/edge_uses.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <numeric>
#include <tuple>

#include "libsurf/base/disjoint_sets.h"

namespace surf::mesh {

std::vector<EdgeUse> edge_uses(const Elements<3>& elements) {
  const auto use = [&](int row, int corner) {
    const int from = elements(row, corner), to = elements(row, (corner + 1) % 3);
    return EdgeUse{std::min(from, to), std::max(from, to), row, corner, from < to};
  };
  assert(elements.rows() == 0 || elements.minCoeff() >= 0);
  // Dealt out to their lower vertices, then sorted among the few of each.
  const int n_vertices = elements.rows() == 0 ? 0 : elements.maxCoeff() + 1;
  std::vector<std::size_t> end_of(n_vertices + 1, 0);  // first where those of the vertex begin
  for (int row = 0; row < elements.rows(); ++row)
    for (int corner = 0; corner < 3; ++corner) ++end_of[use(row, corner).low + 1];
  std::partial_sum(end_of.begin(), end_of.end(), end_of.begin());
  std::vector<EdgeUse> uses(elements.size());
  for (int row = 0; row < elements.rows(); ++row)
    for (int corner = 0; corner < 3; ++corner) {
      const EdgeUse next = use(row, corner);
      uses[end_of[next.low]++] = next;
    }
  auto first = uses.begin();
  for (int vertex = 0; vertex < n_vertices; ++vertex) {
    const auto end = uses.begin() + std::ptrdiff_t(end_of[vertex]);
    std::sort(first, end, [](const EdgeUse& a, const EdgeUse& b) {
      return std::tie(a.high, a.element, a.corner) < std::tie(b.high, b.element, b.corner);
    });
    first = end;
  }
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

std::vector<int> Components::elements_by_component() const {
  std::vector<int> end_of(n + 1, 0);  // first where those of the component begin
  for (const int part : of_element) ++end_of[part + 1];
  std::partial_sum(end_of.begin(), end_of.end(), end_of.begin());
  std::vector<int> rows(of_element.size());
  for (int row = 0; row < static_cast<int>(rows.size()); ++row)
    rows[end_of[of_element[row]]++] = row;
  return rows;
}

}  // namespace surf::mesh
