// The final check of a set of curves, by CGAL, independent of the detection in intersections.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// What was found. Lists hold the first offenders only, at most kMaxListed.
struct Verification {
  static constexpr std::size_t kMaxListed = 10;

  bool closed = false;  ///< at least one element; every node used starts one element and ends one
  bool simple = false;  ///< closed, and no two elements meet but neighbours at their node
  /// Simple, and orientations alternate: a component in an even number of others is
  /// counter-clockwise, one in an odd number clockwise. Then the domain is on the left of all.
  bool alternating = false;

  int n_elements = 0, n_components = 0;
  int n_open_nodes = 0;
  int n_degenerate = 0;     ///< elements without length
  int n_intersections = 0;  ///< pairs of elements
  int n_misoriented_components = 0;
  int n_invalid = 0;  ///< elements with a missing or non-finite point; if any, the
                      ///< other checks are not made
  std::vector<std::pair<int, int>> intersections;  ///< elements

  bool passed() const { return closed && simple && alternating; }
  /// One sentence: "closed, simple, alternating; 1 component, ...", or what is wrong and where.
  std::string message() const;
};

/// Checks any set of segments, exactly. O(n log n) for curves without many intersections.
Verification verify(const Segments& curves);

}  // namespace surf::curve
