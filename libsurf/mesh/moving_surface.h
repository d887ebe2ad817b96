// The triangle surface that a flow moves: OpenMesh connectivity, bisection as it grows, mending,
// and the guards that keep it embedded and inside the volume.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>

#include "libsurf/flow/moving_shape.h"
#include "libsurf/mesh/adaptivity.h"
#include "libsurf/mesh/topology.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// The part of space that voxel centres of a volume span: 0 <= index <= size - 1.
struct VolumeBox {
  Eigen::Affine3d world_to_index;
  Eigen::Affine3d index_to_world;
  std::array<int, 3> size;
};

struct MovingSurfaceOptions {
  /// Wanted edge length where the surface is finest [mm]: edges are bisected above 4/3 of it, if
  /// the indicators ask for it, and collapsed below 0.4 of it.
  double edge_length_mm = 1;
  /// Edges may be this many times longer where all indicators allow; 1 = uniform.
  double coarseness = 1;
  /// The indicators and their tolerances; the limits on lengths follow from the fields above.
  AdaptivityOptions adaptivity = {};
  /// Largest displacement of a vertex in a step [mm]: no more than what the image's edges are wide,
  /// so that none is jumped over. The mesh itself asks for no such bound: Alg. 3 and the guards see
  /// to it that triangles stay triangles.
  double max_displacement_mm = std::numeric_limits<double>::infinity();
  Topology topology = Topology::kFixed;
  /// Unless the topology is fixed: spacing of the grid of a surgery (surgery.h) [mm]; sheets that
  /// face each other and come closer than 0.9 of it are rebuilt. 0 = 0.7 of edge_length_mm.
  double topology_resolution_mm = 0;
  StepAdjustment step_adjustment = StepAdjustment::kNone;
  /// Sheets that have to stay apart are held at this share of edge_length_mm.
  double sheet_distance = 0.7;
  /// Vertices may not leave this box; none = the surface moves freely.
  std::optional<VolumeBox> box;
  /// The run ends when more than this share of the area lies on the box's border.
  double max_border_share = 0.5;
  /// The object has vanished when its radius (of the ball of equal volume) is below this share of
  /// the edge length.
  double min_radius = 0.5;

  std::string error() const;  ///< empty if valid
};

class MovingSurface : public flow::MovingShape<3> {
 public:
  /// @throws InvalidMesh  as to_mesh()
  /// @throws UsageError   options.error() is not empty
  MovingSurface(const Triangles& initial, const MovingSurfaceOptions& options);

  fem::Geometry<3> geometry() const override;
  double max_displacement() const override { return options_.max_displacement_mm; }
  double restrict_move(Points<3>& to) override;
  void move_to(const Points<3>& to) override;
  bool mend() override;
  std::string obstacle() const override;
  bool has_changed_domain() const override { return has_changed_domain_; }
  std::vector<flow::TopologyEvent> take_events() override;

  Triangles triangles() const;
  /// Share of the area whose vertices lie on the box's border.
  double border_share() const;
  /// adaptivity.max_elements has kept the surface from being refined, now or earlier.
  bool is_limited() const { return is_limited_; }
  /// Changes the wanted edge length, and the largest displacement in proportion; the mesh follows
  /// with the next mend.
  void set_edge_length(double edge_length_mm);
  /// Changes what Alg. 7 looks at.
  void set_integrands(std::vector<std::shared_ptr<const Field<3>>> integrands);

 private:
  AdaptivityOptions adaptivity() const;
  void keep_in_box(Points<3>& to) const;
  bool mend(int max_rounds);
  void mend_the_rest(const Triangles& mended);
  bool mend_apart_from(const std::vector<Vector<3>>& places, double radius, int max_rounds);
  double topology_resolution() const;
  void hold_sheets_apart(const Points<3>& from, Points<3>& to, const Elements<3>& T) const;
  void adjust_step(const Points<3>& from, Points<3>& to, const Elements<3>& T) const;
  void resolve_initial_crossings();
  bool resolve_events();
  bool hold_refused(const std::vector<char>& refused);
  bool remove_phantoms_and_crumbs();

  TriMesh mesh_;
  MovingSurfaceOptions options_;
  OpenMesh::VPropHandleT<Eigen::Vector3d> displacement_;  ///< of the last move; 0 for new vertices
  std::vector<flow::TopologyEvent> events_;
  bool has_changed_domain_ = false;  ///< in the last mend()
  bool has_vanished_ = false;        ///< a surgery would leave nothing
  bool is_limited_ = false;
};

}  // namespace surf::mesh
