// Mending of triangles where bisection cannot: edge flips, collapses and tangential moves that
// keep the surface within a tolerance.
#pragma once

#include <limits>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

struct ImproveOptions {
  double min_length = 0;  ///< shorter edges are collapsed [mm], >= 0
  double max_length = 0;  ///< collapses and flips make no longer edge [mm], > 2 * min_length
  /// The surface before the call stays this close to the one after it (at vertices and midpoints
  /// of edges), all operations taken together, and no single one goes further [mm], > 0.
  double tolerance_mm = 0;
  /// Triangles with a smaller angle are flipped or collapsed away; the vertices of those below
  /// this + 10 degrees are moved along the surface. In (0, 50).
  double min_angle_deg = 20;
  /// One flag per face; edges whose two stars hold flagged faces only are collapsed too, each face
  /// at most once, if angles stay above min_angle_deg + 5 degrees and the geometric variation of
  /// the new triangles (fem/indicators.h) below max_variation_mm. Empty = none.
  std::vector<char> may_coarsen = {};
  double max_variation_mm = std::numeric_limits<double>::infinity();
  /// One flag per face: these and their vertices stay as they are. Empty = none.
  std::vector<char> frozen = {};
  /// Vertices stay in this box [borrowed], those on its faces stay on them, and those where the
  /// surface ends on its border stay where they are, or one of two. None = no box.
  const ImageBox<3>* box = nullptr;
  /// Rounds of collapses, flips and moves; ends earlier when nothing is left to do.
  int n_sweeps = 5;
  /// No operation begins once it is requested; the surface is closed and embedded as before.
  std::stop_token stop = {};
  /// Empty if valid, else field, value and constraint.
  std::string error() const;
};

struct ImproveReport {
  int n_collapsed = 0;       ///< edges
  int n_flipped = 0;         ///< edges
  int n_moved = 0;           ///< moves of vertices
  int n_poor = 0;            ///< triangles with an angle below min_angle_deg at the end
  double min_angle_deg = 0;  ///< smallest angle at the end
};

/// Improves the triangles of a closed surface:
/// - collapses edges shorter than min_length, edges within what may be coarsened (where bisections
///   cannot be undone any more, see adaptivity.h), and edges of triangles with a small angle if
///   that removes it; the vertex that is left is put where the enclosed volume does not change;
/// - flips edges whose opposite angles sum to more than 190 degrees, and those of caps;
/// - moves vertices of thin triangles in the tangent plane that keeps the volume (smoothing.h).
///
/// An operation is made only if the link condition holds (the surface stays a manifold of the
/// same genus), no triangle turns by more than 60 degrees, the smallest angle of the patch does not
/// fall (short edges: not below min_angle_deg either way), and the new patch is within the
/// tolerance of the old one and of the vertices and midpoints of edges that were there before the
/// call: faces keep those close to them. (A sum of the distances of all operations would be a
/// strict bound, but it is used up after few of them.) Sharp edges whose height exceeds the
/// tolerance are so kept without being marked. Flips may change
/// the volume by area times tolerance. The checks are local: that two far parts of the surface do
/// not meet is not looked at.
///
/// Deterministic. Collects garbage when something was collapsed: handles die then and
/// properties are renumbered with them. Where faces carry refinement edges, those that a flip or a
/// collapse has changed get their longest edge, and the bisections that made their vertices
/// cannot be undone any more; the others keep theirs, even where vertices were moved.
/// @throws std::invalid_argument  options.error() is not empty
ImproveReport improve(TriMesh& mesh, const ImproveOptions& options);

}  // namespace surf::mesh
