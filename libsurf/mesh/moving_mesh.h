// What the curves and surfaces that a flow moves have in common: their options, the box that they
// stay in, the edges that they stop at, and what ends a run.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/fem/adaptivity.h"
#include "libsurf/flow/moving_shape.h"
#include "libsurf/mesh/neighbourhood.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/mesh/topology.h"

namespace surf::mesh {

template <int Dim>
struct MovingShapeOptions {
  /// Wanted edge length where the shape is finest [mm]: edges are bisected above 4/3 of it, if the
  /// indicators ask for it, and collapsed below 0.4 of it.
  double edge_length_mm = 1;
  /// Edges may be this many times longer where all indicators allow; 1 = uniform.
  double coarseness = 1;
  /// The indicators and their tolerances; the limits on lengths follow from the fields above.
  fem::AdaptivityOptions<Dim> adaptivity = {};
  /// Largest displacement of a vertex in a step [mm]: no more than what the image's edges are wide,
  /// so that none is jumped over. The mesh itself asks for no such bound: Alg. 3 and the guards see
  /// to it that elements stay elements.
  double max_displacement_mm = std::numeric_limits<double>::infinity();
  /// A vertex stops at the first edge on its way: where this field, looked at every
  /// path_spacing_mm, has a minimum below 0.7 of what lies before it and behind it. None = vertices
  /// may jump over edges.
  std::shared_ptr<const Field<Dim>> edge_indicator = {};
  double path_spacing_mm = 0;
  /// Curves have no kGenus0.
  Topology topology = Dim == 2 ? Topology::kFree : Topology::kFixed;
  /// Unless the topology is fixed: sheets that face each other and come closer than 0.9 of it are
  /// joined; the spacing of the grid of a surface's surgery (surgery.h) [mm]. 0 = 0.7 of
  /// edge_length_mm.
  double topology_resolution_mm = 0;
  /// Components that enclose less go, with what lies in them [mm^Dim]; 0 = those of a circle or
  /// ball whose radius is the topology's resolution.
  double min_content = 0;
  /// Sheets that have to stay apart are held at this share of edge_length_mm.
  double sheet_distance = 0.7;
  /// Vertices may not leave this box; none = the shape moves freely.
  std::optional<ImageBox<Dim>> box = {};
  /// The run ends when the shape covers more than this share of the box's own border: it has leaked
  /// and fills the image. Objects that the border cuts off cover less.
  double max_border_share = 0.9;
  /// The object has vanished when its radius (of the disc or ball of equal content) is below this
  /// share of the edge length.
  double min_radius = 0.5;
  /// Points that stay on their side of the shape, no nearer to it than this distance [mm]: balls
  /// round them are obstacles from when the shape has a point where it belongs. A start that has
  /// not is moved by up to three edge lengths to where it has.
  std::vector<HeldPoint<Dim>> held_points = {};
  double held_distance_mm = 0;
  /// The shape moves where this has one of its vertices, and stays elsewhere, bit for bit; null =
  /// everywhere. Not heeded while a start is rebuilt where it crosses itself, and moved to where it
  /// has held points. Nor is anything else mended but what surgery makes of it.
  std::shared_ptr<const Neighbourhood<Dim>> region = {};
  /// A start is mended no further once it is requested; the shape is closed and embedded anyway.
  std::stop_token stop = {};

  std::string error() const;  ///< empty if valid
};

template <int Dim>
class MovingMesh : public flow::MovingShape<Dim> {
 public:
  using Options = MovingShapeOptions<Dim>;

  virtual Simplices<Dim> simplices() const = 0;
  /// Share of the length or area whose vertices lie on the box's border.
  double border_share() const;
  /// Share of the box's border that elements of the shape cover.
  double covered_border() const;
  /// adaptivity.max_elements has kept the shape from being refined, now or earlier.
  bool is_limited() const { return is_limited_; }
  /// There is a region, and no vertex in it: all of the shape stays. geometry() is then that of the
  /// whole, which an evolution would move.
  bool rests() const { return rests_; }
  /// Nothing of the object is left, or less than options.min_radius allows.
  bool has_vanished() const;

  /// With the box's faces as its border.
  fem::Geometry<Dim> geometry() const override;
  flow::ShapeSize size() const override;
  double restrict_move(Points<Dim>& to) final;
  void move_to(const Points<Dim>& to) final;
  bool mend() final;
  double max_displacement() const override { return options_.max_displacement_mm; }
  std::string obstacle() const override;
  bool has_changed_domain() const override { return has_changed_domain_; }
  std::vector<flow::TopologyEvent> take_events() override;

 protected:
  /// @throws UsageError  options.error() is not empty
  explicit MovingMesh(const Options& options);

  /// The indicators with the limits on lengths that follow from the wanted one.
  fem::AdaptivityOptions<Dim> adaptivity() const;
  /// Edges shorter than this are collapsed [mm].
  double shortest_edge() const;
  /// By which mending may move the shape [mm].
  double mending_tolerance() const;
  double topology_resolution() const;
  double min_content() const;
  /// Flags of the elements without a vertex in the region; empty if there is none.
  std::vector<char> resting_elements() const;
  /// Those of them that surgery has not made, which is as thin as its grid cuts it: with all of it
  /// in the region, so that it moves too, a liver's boundary that had come to rest leaked.
  std::vector<char> unmended_elements() const;
  /// Whether an element with these corners is one of them.
  bool is_unmended(const Eigen::Matrix<double, Dim, Dim>& corners) const;
  /// Where vertices are that were not there before surgery.
  void note_rebuilt(const Points<Dim>& before);
  void keep_in_box(Points<Dim>& to) const;
  /// Vertices stay in the box and stop at the edges on their way, and elements slide round the
  /// obstacles.
  void bound_move(const Points<Dim>& from, const Elements<Dim>& T, Points<Dim>& to) const;

  /// Round the held points that the shape has where they belong.
  const PointObstacles<Dim>& obstacles() const { return obstacles_; }
  /// Those of them between sheets that surgery would have joined: sheets near these stay apart.
  const PointObstacles<Dim>& contested() const { return contested_; }
  /// Takes held points for obstacles that the shape has come to have where they belong.
  void take_up_obstacles();
  /// The same anew, after what may have lost some; at its start.
  void find_obstacles();
  /// Brings the shape to where it has the held points near it, where it can; at its start.
  void approach_held_points();
  /// After surgery: numbers of the obstacles that the shape reaches into or has on the wrong side.
  std::vector<std::size_t> lost_obstacles() const;
  /// These obstacles are contested from now on.
  void contest(const std::vector<std::size_t>& lost);

  /// What restrict_move(), move_to() and mend() do to the whole shape.
  virtual double restrict_whole(Points<Dim>& to) = 0;
  virtual void move_whole_to(const Points<Dim>& to) = 0;
  virtual bool mend_whole() = 0;
  /// What moves, anew; at its start.
  void find_part();

  Options options_;
  std::vector<flow::TopologyEvent> events_;
  bool has_changed_domain_ = false;  ///< in the last mend()
  bool has_vanished_ = false;        ///< a surgery would leave nothing
  bool is_limited_ = false;

 private:
  fem::Geometry<Dim> geometry_of(const Simplices<Dim>& shape) const;
  void stop_at_edges(const Points<Dim>& from, Points<Dim>& to) const;
  bool approach(const HeldPoint<Dim>& held);

  std::vector<char> is_obstacle_;  ///< of the held points
  PointObstacles<Dim> obstacles_, waiting_, contested_;
  std::vector<char> is_left_out_;  ///< elements that geometry() has not; empty = it has all
  std::vector<int> part_;          ///< vertices of geometry(); empty = all
  bool rests_ = false;
  std::optional<Neighbourhood<Dim>> rebuilt_;  ///< by surgery, if there is a region
};

/// Share of the length or area that belongs to vertices chosen: of each element the same for each
/// of its vertices.
/// @param is_chosen  of a vertex
template <int Dim>
double share_of_vertices(const Points<Dim>& X, const Elements<Dim>& T,
                         const std::vector<char>& is_chosen);

/// Vertices that stay at `from` although they wanted to go elsewhere.
template <int Dim>
std::vector<char> held_vertices(const Points<Dim>& from, const Points<Dim>& wanted,
                                const Points<Dim>& to);

}  // namespace surf::mesh
