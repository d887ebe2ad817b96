// Space adaptivity of curves, thesis 4.2, and the redistribution of their nodes (4.1.2).
#pragma once

#include <functional>

#include "libcurve/mesh/curve_mesh.h"
#include "libsurf/fem/adaptivity.h"

namespace surf::curve {

using AdaptivityOptions = fem::AdaptivityOptions<2>;

using fem::AdaptivityReport;

/// A question about a node.
using NodeTest = std::function<bool(const CurveMesh&, int)>;

/// Marks, bisects marked elements once (d - 1 = 1) at their midpoints, and removes nodes both of
/// whose elements are marked for coarsening, until nothing changes or for max_rounds rounds.
///
/// Alg. 6 as printed can refine and coarsen for ever. Here a node is removed only if the element
/// that comes back would not be marked for refinement by its length and h_S theta_S, and the error
/// of a quadrature is taken to grow by 8 at most; nor if the curve turns by more than 60 degrees
/// there. No two neighbours go in one round.
/// @throws UsageError  options.error() is not empty
/// @param is_fixed  nodes that are not removed; none = all may be
AdaptivityReport adapt(CurveMesh& curves, const AdaptivityOptions& options, int max_rounds = 30,
                       const NodeTest& is_fixed = {});

/// Joins elements shorter than min_length to a neighbour, where the node that goes lies within
/// `tolerance` of the new element [mm] and this is no longer than max_length.
/// @param is_fixed  nodes that only go with an element between two of them; none = all may
/// @param rests     nodes that stay in any case; none = all may go
/// @return  number of removed nodes
int remove_short(CurveMesh& curves, double min_length, double max_length, double tolerance,
                 const NodeTest& is_fixed = {}, const NodeTest& rests = {});

struct SmoothingOptions {
  int n_sweeps = 1;
  /// Nodes move only where their elements' lengths have more than this ratio.
  double max_ratio = 1;
  /// And only where they stand no further than this from the line through their neighbours [mm]:
  /// corners stay.
  double max_height_mm = 1e300;
  NodeTest is_fixed = {};  ///< nodes that stay; none = all may move
};

/// Algorithm 4 in the plane: Gauss-Seidel sweeps, in which a node goes along the parallel to the
/// line through its neighbours, on which the enclosed area stays the same, towards the average of
/// the midpoints of its elements, weighted by their lengths.
/// @return  number of moves
int smooth(CurveMesh& curves, const SmoothingOptions& options = {});

}  // namespace surf::curve
