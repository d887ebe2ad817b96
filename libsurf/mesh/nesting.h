// Where a component of a shape lies among the others: curves in the plane, shells in space.
#pragma once

#include <optional>

namespace surf::mesh {

struct Nesting {
  bool is_outward = true;     ///< the sign of the exact content, which rounding may hide
  int depth = 0;              ///< number of components that enclose it
  std::optional<int> parent;  ///< the innermost of them
  /// Winding number of the whole shape just before the component, where its normals point to;
  /// behind it, it is one more.
  int winding_before = 0;

  /// It separates the domain from the rest: winding number 0 before it, 1 behind. All others are
  /// phantoms: an inverted component in the open (-1 | 0), an outward one in an outward one
  /// (1 | 2).
  bool is_real() const { return winding_before == 0; }
};

}  // namespace surf::mesh
