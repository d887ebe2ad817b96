// The curves that a flow moves: linked elements, bisection and coarsening, topology surgery, and
// the guards that keep them simple and inside the image.
#pragma once

#include "libcurve/mesh/adaptivity.h"
#include "libsurf/mesh/moving_mesh.h"

namespace surf::curve {

using mesh::Topology;

using MovingCurveOptions = mesh::MovingShapeOptions<2>;

class MovingCurve : public mesh::MovingMesh<2> {
 public:
  /// Nodes outside the box start on its border. With kFree, curves that intersect become the
  /// boundary of the domain round which they wind.
  /// @throws InvalidMesh  not a set of closed polygons, they meet and the topology is fixed, or
  /// nothing is left of them
  /// @throws UsageError   options.error() is not empty
  MovingCurve(const Segments& initial, const MovingCurveOptions& options);

  Segments simplices() const override;
  /// Moves that were taken back because surgery could not resolve what they led to, or would have
  /// left nothing.
  int n_taken_back() const { return n_taken_back_; }

 private:
  double restrict_whole(Points<2>& to) override;
  void move_whole_to(const Points<2>& to) override;
  bool mend_whole() override;
  void hold_sheets_apart(const Points<2>& from, Points<2>& to) const;
  void hold_contested_sheets(const Points<2>& from, Points<2>& to) const;
  void hold(const Points<2>& from, Points<2>& to) const;
  bool push_away();
  bool has_lost_obstacles();
  bool resolve_events();
  NodeTest border_ends() const;
  NodeTest resting_nodes() const;
  bool mend_mesh(int max_rounds);

  CurveMesh mesh_;
  Points<2> before_;  ///< the nodes before the last move; no rows if there was none
  int n_taken_back_ = 0;
};

}  // namespace surf::curve
