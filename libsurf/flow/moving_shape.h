// What a flow asks of the object that owns a shape's connectivity.
#pragma once

#include <string>
#include <vector>

#include "libsurf/fem/geometry.h"

namespace surf::flow {

/// What a surgery did to the components of a shape (thesis Fig. 4.3, and in three dimensions).
enum class TopologyChange {
  kUntangling,     ///< nothing: a fold was taken out
  kMerging,        ///< several components became fewer
  kSelfMerging,    ///< one met itself: a surface has a handle more, or several; a curve a hole
  kSelfCrossing,   ///< a curve crossed itself and is one as before
  kHandleClosing,  ///< a handle less: its hole was filled, or it was cut
  kSplitting,      ///< one came apart
  kInsideOpening,  ///< a surface met itself all round: it has a cavity more; a curve met its hole
  kVanishing       ///< nothing is left of some
};
/// "merging", "self-merging", "handle-closing", ...
std::string to_string(TopologyChange change);

/// A change of the shape's topology, as it happened after a step.
struct TopologyEvent {
  TopologyChange kind = TopologyChange::kUntangling;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [mm]; in the plane the third is 0
  double enclosed_change = 0;                       ///< of the enclosed area or volume
};

/// Of a whole shape.
struct ShapeSize {
  double enclosed = 0;  ///< area [mm^2] or volume [mm^3]
  Eigen::Index n_vertices = 0, n_elements = 0;
};

/// A curve or surface that a flow moves. The flow sees arrays only; bisection, smoothing and
/// guards against self-intersection are behind mend and admissible.
template <int Dim>
class MovingShape {
 public:
  virtual ~MovingShape() = default;

  /// The current points and elements, of the part that moves: the rest may be left out
  /// (fem::WholeShape). The arrays of restrict_move() and move_to() are of its vertices, until the
  /// shape is mended.
  virtual fem::Geometry<Dim> geometry() const = 0;
  /// Of the whole shape.
  virtual ShapeSize size() const {
    const fem::Geometry<Dim> now = geometry();
    return {now.enclosed(), now.n_vertices(), now.n_elements()};
  }
  /// Largest displacement of a vertex in one step [mm]; never more than the shape's radius is used.
  virtual double max_displacement() const = 0;
  /// Takes back what may not move there (vertices at the volume's border, sheets about to
  /// touch): `to` (n, Dim) is changed in place. Returns the share of the length or area whose
  /// vertices are held back because sheets would touch or triangles intersect or turn over.
  virtual double restrict_move(Points<Dim>& to) = 0;
  /// Moves the vertices.
  virtual void move_to(const Points<Dim>& to) = 0;
  /// Adapts and mends the mesh after a move; true if points or elements changed.
  virtual bool mend() = 0;
  /// A reason to end the run ("the object vanished", "the surface meets the volume's
  /// border"), else empty.
  virtual std::string obstacle() const = 0;
  /// Whether the last mend() changed the domain too, by topology surgery: integrals over it have to
  /// be computed anew.
  virtual bool has_changed_domain() const { return false; }
  /// What happened since the last call.
  virtual std::vector<TopologyEvent> take_events() { return {}; }
};

}  // namespace surf::flow
