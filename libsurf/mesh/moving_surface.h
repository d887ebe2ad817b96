// The triangle surface that a flow moves: OpenMesh connectivity, bisection as it grows, mending,
// and the guards that keep it embedded and inside the volume.
#pragma once

#include <optional>
#include <vector>

#include "libsurf/mesh/moving_mesh.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

using MovingSurfaceOptions = MovingShapeOptions<3>;

class MovingSurface : public MovingMesh<3> {
 public:
  /// What reaches out of the box is cut off.
  /// @throws InvalidMesh  as to_mesh(), or nothing lies in the box
  /// @throws UsageError   options.error() is not empty
  MovingSurface(const Triangles& initial, const MovingSurfaceOptions& options);

  Triangles simplices() const override;

 private:
  double restrict_whole(Points<3>& to) override;
  void move_whole_to(const Points<3>& to) override;
  bool mend_whole() override;
  bool mend_mesh(int max_rounds);
  bool mend_the_rest(const Triangles& mended);
  bool mend_apart_from(const std::vector<Vector<3>>& places, double radius, int max_rounds);
  void hold_sheets_apart(const Points<3>& from, Points<3>& to, const Elements<3>& T) const;
  void hold_contested_sheets(const Points<3>& from, Points<3>& to, const Elements<3>& T) const;
  void hold(const Points<3>& from, Points<3>& to, const Elements<3>& T) const;
  void bring_into_box();
  std::vector<Vector<3>> push_away();
  bool holds_a_point(const Triangles& surface, const std::vector<int>& of_triangle,
                     int shell) const;
  void resolve_initial_crossings();
  void clip_at_start();
  bool resolve_events();
  bool hold_refused(const std::vector<char>& refused);
  bool remove_phantoms_and_crumbs();

  TriMesh mesh_;
  OpenMesh::VPropHandleT<Eigen::Vector3d> displacement_;  ///< of the last move; 0 for new vertices
};

}  // namespace surf::mesh
