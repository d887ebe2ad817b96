// How sure the place of a shape is.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/mesh/shape_part.h"

namespace surf::segment {

/// What locate_edges() knows of each vertex of a shape, and of the shape as a whole.
template <int Dim>
struct Certainty {
  /// Standard deviation of the vertex' distance to the edge [mm], (n): in 95 of 100 vertices with
  /// an edge twice as much holds it. Without an edge as far as was looked for one; 0 on the image's
  /// border, where the shape ends because the image does.
  Eigen::VectorXd deviation_mm;
  /// Height of the step across the vertex by the deviation of the noise, (n), >= 0.
  Eigen::VectorXd edge_strength;
  /// Vertices where a step fits, (n).
  std::vector<char> has_edge;
  double content_deviation = 0;   ///< standard deviation of the enclosed content [mm^Dim]
  double share_without_edge = 0;  ///< of the length or area off the image's border
  /// Where a click would tell most: the vertex without an edge that is furthest from those with one
  /// along the shape; none where all have one.
  std::optional<Vector<Dim>> next_click_mm;
};

/// Share of the length or area without an edge, and the place to click next: of the parts of the
/// shape without an edge, parts by way of elements, the vertex that is furthest from all vertices
/// with one along the shape's edges.
/// @param on_border  vertices that do not count, (n)
template <int Dim>
void find_doubt(const Simplices<Dim>& shape, const std::vector<char>& on_border,
                Certainty<Dim>& certainty);

/// Flags of the vertices of a shape that are among those of `of`, by their coordinates.
template <int Dim>
std::vector<char> are_vertices_of(const Simplices<Dim>& of, const Simplices<Dim>& shape);

/// Of a shape of which a part has been located anew, and the rest is as it was.
/// @param known    of the vertices of `of`
/// @param anew     of the part's vertices; those that are shared keep what is known of them
/// @param shape    its vertices beyond the part are among those of `of`, by their coordinates
/// @throws std::out_of_range  one of them is not
template <int Dim>
Certainty<Dim> amended_certainty(const Certainty<Dim>& known, const Simplices<Dim>& of,
                                 const Certainty<Dim>& anew, const mesh::ShapePart<Dim>& part,
                                 const Simplices<Dim>& shape);

/// Of the vertices of a shape that are among those of `of`, by their coordinates, such as after
/// components went.
/// @pre  every point of `shape` is one of `of`
template <int Dim>
Certainty<Dim> certainty_of_part(const Certainty<Dim>& certainty, const Simplices<Dim>& of,
                                 const Simplices<Dim>& shape);

}  // namespace surf::segment
