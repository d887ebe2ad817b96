// Edges of a triangle soup: works for any elements, manifold or not.
#pragma once

#include <span>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// One triangle running along one of its edges.
struct EdgeUse {
  int low, high;    ///< vertices of the edge, low < high (equal in a broken triangle)
  int element;      ///< row of the triangle
  int corner;       ///< the edge runs from this corner to the next
  bool is_forward;  ///< it runs from low to high
};

/// All 3 m uses, sorted by edge and then by triangle. O(m + n), n the highest index, where few
/// triangles meet at a vertex.
/// @param elements  no index < 0
std::vector<EdgeUse> edge_uses(const Elements<3>& elements);

/// Calls visit(span of the uses of one edge) for each edge.
template <class Visit>
void for_each_edge(const std::vector<EdgeUse>& uses, Visit visit) {
  for (std::size_t first = 0; first < uses.size();) {
    std::size_t last = first + 1;
    while (last < uses.size() && uses[last].low == uses[first].low &&
           uses[last].high == uses[first].high)
      ++last;
    visit(std::span(uses).subspan(first, last - first));
    first = last;
  }
}

/// Triangles joined by edges: the component of each, numbered from 0 in the order of their
/// first triangles.
struct Components {
  int n = 0;
  std::vector<int> of_element;

  /// The rows of the first component's triangles, then those of the second...
  std::vector<int> elements_by_component() const;
};
Components components(const std::vector<EdgeUse>& uses, Eigen::Index n_elements);

}  // namespace surf::mesh
