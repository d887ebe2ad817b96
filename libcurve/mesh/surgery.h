// Topology surgery on curves (thesis 4.3.2.3): where they cross, touch or come close they become
// the boundary of the domain round which they wind.
#pragma once

#include <string>
#include <vector>

#include "libcurve/mesh/curve_mesh.h"
#include "libsurf/flow/moving_shape.h"

namespace surf::curve {

/// Sheets are joined below this share of the resolution.
constexpr double kContact = 0.9;

struct SurgeryOptions {
  /// Topology resolution [mm], >= 0. Elements at events are bisected down to twice this length
  /// (Alg. 11), and sheets that face each other and come closer than 0.9 of it are joined: gaps are
  /// closed, walls are cut. 0 = only what meets is changed.
  double resolution_mm = 0;
  /// Components that enclose less go, with all that lies in them [mm^2].
  double min_area_mm2 = 0;
  /// But for such as hold one of these [mm], whichever way they are oriented.
  std::vector<Vector<2>> kept_points = {};
  /// Rounded crossings may meet other elements anew: rounds until nothing meets.
  int max_rounds = 20;

  std::string error() const;  ///< empty if valid
};

struct SurgeryReport {
  bool has_changed = false;
  /// Nothing meets any more. Else the curves are as they were.
  bool is_resolved = true;
  /// "merging", "inside-opening", "splitting", "self-merging", "self-crossing" (Fig. 4.3) with the
  /// change of the signed area, and "vanishing": a component that does not bound the domain, is too
  /// small or has shrunk through itself (most of its length turned over in the move).
  std::vector<flow::TopologyEvent> events;
  int n_crumbs = 0;           ///< components that the surgery made and that were too small
  double crumb_area_mm2 = 0;  ///< of these
};

/// The domain is where the winding number is at least one. Afterwards the curves are simple, closed
/// and alternate in orientation; nodes of elements that took no part stay in their order, bit for
/// bit, new ones follow. Any set of closed polygons is resolved, however it crosses, touches or
/// overlaps itself. May leave nothing.
/// @param before  the nodes before the last move, for sheets that came closer; no rows: only what
///                meets is changed
/// @throws UsageError  options.error() is not empty
SurgeryReport operate(CurveMesh& curves, const SurgeryOptions& options,
                      const Points<2>& before = {});

/// Pairs of elements without a common node that face each other (normals more than 100 degrees
/// apart) closer than `distance` and closer than before the move, and that are not near along the
/// curve: no less than three times the distance.
std::vector<std::pair<int, int>> sheets_in_contact(const CurveMesh& curves, const Points<2>& before,
                                                   double distance);

}  // namespace surf::curve
