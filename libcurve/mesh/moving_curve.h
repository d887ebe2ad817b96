// The curves that a flow moves: linked elements, bisection and coarsening, topology surgery, and
// the guards that keep them simple and inside the image.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libcurve/mesh/adaptivity.h"
#include "libcurve/mesh/curve_mesh.h"
#include "libsurf/flow/moving_shape.h"
#include "libsurf/mesh/topology.h"

namespace surf::curve {

using mesh::StepAdjustment;
using mesh::Topology;

/// The part of the plane that pixel centres of an image span: 0 <= index <= size - 1.
struct ImageBox {
  Eigen::Affine2d world_to_index;
  Eigen::Affine2d index_to_world;
  std::array<int, 2> size;
};

struct MovingCurveOptions {
  /// Wanted edge length where the curves are finest [mm]: elements are bisected above 4/3 of it, if
  /// the indicators ask for it, and coarsened below 0.4 of it.
  double edge_length_mm = 1;
  /// Elements may be this many times longer where all indicators allow; 1 = uniform.
  double coarseness = 1;
  /// The indicators and their tolerances; the limits on lengths follow from the fields above.
  AdaptivityOptions adaptivity = {};
  /// Largest displacement of a node in a step [mm].
  double max_displacement_mm = std::numeric_limits<double>::infinity();
  /// A node stops at the first edge on its way: where this field, looked at every path_spacing_mm,
  /// has a minimum below 0.7 of what lies before it and behind it. None = nodes may jump over
  /// edges.
  std::shared_ptr<const Field<2>> edge_indicator;
  double path_spacing_mm = 0;
  /// kFree or kFixed.
  Topology topology = Topology::kFree;
  /// With kFree: sheets that face each other and come closer than 0.9 of it are joined [mm]. 0 =
  /// 0.7 of edge_length_mm.
  double topology_resolution_mm = 0;
  /// Alg. 10: steps are shortened until only two places are left where elements meet, as one event
  /// has them (kCatchFirst), or one (kResolveFirst); if that cannot be, to the first events.
  StepAdjustment step_adjustment = StepAdjustment::kNone;
  /// Components that enclose less go, with what lies in them [mm^2]; 0 = those of a circle of
  /// radius topology_resolution_mm.
  double min_area_mm2 = 0;
  /// With kFixed, sheets are held at this share of edge_length_mm.
  double sheet_distance = 0.7;
  /// Nodes may not leave this box, nor start outside: they do on its border; none = the curves move
  /// freely.
  std::optional<ImageBox> box;
  /// The run ends when more than this share of the length lies on the box's border.
  double max_border_share = 0.5;
  /// The object has vanished when its radius (of the disc of equal area) is below this share of
  /// the edge length.
  double min_radius = 0.5;

  std::string error() const;  ///< empty if valid
};

class MovingCurve : public flow::MovingShape<2> {
 public:
  /// With kFree, curves that intersect become the boundary of the domain round which they wind.
  /// @throws InvalidMesh  not a set of closed polygons, or nothing is left of them
  /// @throws UsageError   options.error() is not empty
  MovingCurve(const Segments& initial, const MovingCurveOptions& options);

  fem::Geometry<2> geometry() const override;
  double max_displacement() const override { return options_.max_displacement_mm; }
  double restrict_move(Points<2>& to) override;
  void move_to(const Points<2>& to) override;
  bool mend() override;
  std::string obstacle() const override;
  bool has_changed_domain() const override { return has_changed_domain_; }
  std::vector<flow::TopologyEvent> take_events() override;

  Segments segments() const;
  /// Share of the length whose nodes lie on the box's border.
  double border_share() const;
  /// adaptivity.max_elements has kept the curves from being refined, now or earlier.
  bool is_limited() const { return is_limited_; }
  /// Moves that were taken back because surgery could not resolve what they led to, or would have
  /// left nothing.
  int n_taken_back() const { return n_taken_back_; }
  /// Changes the wanted edge length, and the largest displacement in proportion; the mesh follows
  /// with the next mend.
  void set_edge_length(double edge_length_mm);
  /// Changes what Alg. 7 looks at.
  void set_integrands(std::vector<std::shared_ptr<const Field<2>>> integrands);

 private:
  double topology_resolution() const;
  double min_area() const;
  void keep_in_box(Points<2>& to) const;
  void stop_at_edges(const Points<2>& from, Points<2>& to) const;
  void hold_sheets_apart(const Points<2>& from, Points<2>& to) const;
  void adjust_step(const Points<2>& from, Points<2>& to) const;
  bool resolve_events();
  bool mend_mesh(int max_rounds);

  CurveMesh mesh_;
  MovingCurveOptions options_;
  Points<2> before_;  ///< the nodes before the last move; no rows if there was none
  std::vector<flow::TopologyEvent> events_;
  bool has_changed_domain_ = false;  ///< in the last mend()
  bool has_vanished_ = false;        ///< a surgery would leave nothing
  bool is_limited_ = false;
  int n_taken_back_ = 0;
};

}  // namespace surf::curve
