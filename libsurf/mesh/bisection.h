// Newest-vertex bisection with conforming closure, and its inverse.
//
// Each face carries its refinement edge. Bisecting a face halves that edge; the two children
// get the edges opposite the new vertex as theirs. A neighbour across the refinement edge whose
// own refinement edge is another one is bisected first, so the surface has no hanging node at
// any moment. The triangles below one initial triangle fall into four similarity classes, and
// no angle gets smaller than half the smallest of the initial triangle when that one is marked at
// its longest edge.
//
// Why it ends: the closure walks from a face across refinement edges, to a face that it has not
// passed yet, so the walk is finite. It ends in two faces that share their refinement edge, or it
// comes back to a face it has passed. After mark_longest_edges() it cannot come back since along a
// walk edges only get longer, but marks that were chosen locally may have such cycles, of three
// faces or more. Then the longest edge that the cycle crosses, ties by the pair of vertex
// indices, becomes the refinement edge of both of its faces. In either case two faces share
// theirs and are bisected, and so is the rest of the walk, one face after the other, for a child of
// the next face has the edge between them as its refinement edge.
//
// The inverse: each new vertex remembers the edge it halved and how its parents' rows began. While
// its star is the four children, it can be removed, and the parents are what they were.
#pragma once

#include <array>
#include <functional>
#include <span>

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// Called for each new vertex, after it stands at the midpoint of the edge (a, b) and is connected:
/// the place where properties of vertices are interpolated and a history is written.
using BisectionHook = std::function<void(OpenMesh::VertexHandle new_vertex,
                                         OpenMesh::VertexHandle a, OpenMesh::VertexHandle b)>;

/// Makes the longest edge of each face its refinement edge, ties by the pair of vertex indices.
/// No bisection before this can be undone.
void mark_longest_edges(TriMesh& mesh);

/// The same for some faces, after their connectivity has changed or where vertices have moved far:
/// no bisection that made one of their vertices can be undone, others can.
/// @pre has_refinement_edges(mesh)
void mark_longest_edges(TriMesh& mesh, std::span<const OpenMesh::FaceHandle> faces);

/// Whether the faces carry refinement edges.
bool has_refinement_edges(const TriMesh& mesh);

/// The half-edge of `face` that bisection would halve; its opposite vertex is the newest one.
/// @pre has_refinement_edges(mesh)
OpenMesh::HalfedgeHandle refinement_edge(const TriMesh& mesh, OpenMesh::FaceHandle face);

/// Removes the refinement edges and the memory of bisections; operations that change the
/// connectivity otherwise, and do not call mark_longest_edges() for the faces they touch, do so
/// first.
void clear_refinement_edges(TriMesh& mesh);

/// Nothing if faces carry no refinement edges.
/// @throws InvalidMesh  a refinement edge is not of its face, or a vertex names an edge's end that
///                      is none as the place of its birth
void check_refinement_edges(const TriMesh& mesh);

/// mesh.garbage_collection() that renumbers refinement edges and the memory of bisections; handles
/// in other properties are not. Where deleted elements are the last ones, the rest keeps its order.
void collect_garbage(TriMesh& mesh);

/// Bisects each marked face once, and what the closure needs; a face that the closure has
/// bisected already is left alone, and so is one marked twice. Handles stay valid: a bisected
/// face's handle is that of a child, new handles follow the old ones. Without refinement edges
/// mark_longest_edges() comes first. New faces, and halves of edges, get all properties of those
/// they are a part of. Time is linear in the number of faces and new vertices.
/// @return  number of new vertices; the faces grow by twice as many
/// @pre     no garbage
int bisect(TriMesh& mesh, std::span<const OpenMesh::FaceHandle> marked,
           const BisectionHook& hook = {});

/// Whether the bisection that made a vertex can be undone now: its star is the four children.
bool is_removable(const TriMesh& mesh, OpenMesh::VertexHandle vertex);

/// The ends of the edge that was halved at the vertex. @pre is_removable(mesh, vertex)
std::array<OpenMesh::VertexHandle, 2> bisected_edge(const TriMesh& mesh,
                                                    OpenMesh::VertexHandle vertex);

/// Undoes bisections: removes each vertex whose star is the four children of its bisection, all of
/// them marked. The parents get the handles, rows and refinement edges they had; they have the
/// properties of a child. Where the closure of one call of bisect() bisected a face and then its
/// children, one call undoes both: parents of marked children count as marked for vertices of the
/// same call. So coarsening all faces as often as all were bisected before gives the same mesh
/// again, bit for bit but for the places of vertices that were moved in between. A cycle that
/// bisect() had to break stays broken.
///
/// Collects garbage: handles die. Time is linear in the number of faces.
/// @param may_remove  asked once for each vertex that could go
/// @return            number of removed vertices; the faces shrink by twice as many
/// @pre               no garbage
int coarsen(TriMesh& mesh, std::span<const OpenMesh::FaceHandle> marked,
            const std::function<bool(OpenMesh::VertexHandle)>& may_remove = {});

}  // namespace surf::mesh
