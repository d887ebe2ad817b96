// Newest-vertex bisection with conforming closure.
//
// Each face carries its refinement edge. Bisecting a face halves that edge; the two children
// get the edges opposite the new vertex as theirs. A neighbour across the refinement edge whose
// own refinement edge is another one is bisected first, so the surface has no hanging node at
// any moment. The triangles below one initial triangle fall into four similarity classes, and
// no angle gets smaller than half the smallest of the initial triangle when that one is marked at
// its longest edge.
//
// Why it ends: follow from each face the neighbour across its refinement edge. If those paths have
// no cycle but pairs of faces that share their refinement edge, a bisection makes none: children
// are refined at old edges, so no face leads into a child's new edges. mark_longest_edges() gives
// such a start since along a path edges only get longer.
#pragma once

#include <functional>
#include <span>

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// Called for each new vertex, after it stands at the midpoint of the edge (a, b) and is connected:
/// the place where properties of vertices are interpolated and a history is written.
using BisectionHook = std::function<void(OpenMesh::VertexHandle new_vertex,
                                         OpenMesh::VertexHandle a, OpenMesh::VertexHandle b)>;

/// Makes the longest edge of each face its refinement edge, ties by the pair of vertex indices.
void mark_longest_edges(TriMesh& mesh);

/// Whether the faces carry refinement edges.
bool has_refinement_edges(const TriMesh& mesh);

/// The half-edge of `face` that bisection would halve; its opposite vertex is the newest one.
/// @pre has_refinement_edges(mesh)
OpenMesh::HalfedgeHandle refinement_edge(const TriMesh& mesh, OpenMesh::FaceHandle face);

/// Removes the refinement edges; operations that change the connectivity otherwise do so first.
void clear_refinement_edges(TriMesh& mesh);

/// Nothing if faces carry no refinement edges.
/// @throws InvalidMesh  a refinement edge is not of its face, or bisection might not end
void check_refinement_edges(const TriMesh& mesh);

/// Bisects each marked face once, and what the closure needs; a face that the closure has
/// bisected already is left alone, and so is one marked twice. Handles stay valid: a bisected
/// face's handle is that of a child, new handles follow the old ones. Without refinement edges
/// mark_longest_edges() comes first. Time is linear in the number of new vertices.
/// @return  number of new vertices; the faces grow by twice as many
/// @pre     no garbage
int bisect(TriMesh& mesh, std::span<const OpenMesh::FaceHandle> marked,
           const BisectionHook& hook = {});

/// Which edges refine_long_edges() halves. Measured on a ball that is stretched in 100 small steps
/// to the axes 1:3:1 while its area grows by 118, edges limited in each step:
///
///     chosen      triangles  smallest angle  under 25 degrees
///     kKeep           39576            12.4              32 %
///     kLongest        30976            14.1               7 %
///
/// With improve() (improve.h) after each step both end near 23 500 triangles and 30 degrees.
enum class RefinementEdges {
  /// Those that the faces carry: the history of bisections stays valid, so that they can be undone.
  /// Where vertices have moved far since the edges were chosen, children are thin.
  kKeep,
  /// The longest of each face, chosen anew on the whole mesh before each round: safe, since that is
  /// a start from which bisection ends. Better angles on a surface that has moved, at the
  /// price of the history.
  kLongest
};

/// Bisects all faces with an edge longer than max_length until there is none.
/// @param max_length  [mm], > 0
/// @return            number of new vertices
int refine_long_edges(TriMesh& mesh, double max_length,
                      RefinementEdges edges = RefinementEdges::kLongest,
                      const BisectionHook& hook = {});

}  // namespace surf::mesh
