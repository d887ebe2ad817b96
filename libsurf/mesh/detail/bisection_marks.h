// What faces and vertices remember of bisections, shared between sources of this library.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <tuple>

#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// What it takes to undo the bisection that made a vertex. Its parents' handles need no place here:
/// they are those of the children at the half of the edge that has kept its handle.
struct Birth {
  /// Ends of the halved edge; the half at b has the handle of the whole. Invalid: never born by
  /// bisection, or the star has changed otherwise since.
  OpenMesh::VertexHandle a, b;
  /// Steps from the halved edge to where the parent's row began; left and right of a -> b.
  std::uint8_t start_left = 0, start_right = 0;
  int call = 0;  ///< of bisect(), counted from the first marking on

  bool is_valid() const { return a.is_valid(); }
};

/// The marks that a mesh carries, all of them or none.
struct Marks {
  OpenMesh::FPropHandleT<OpenMesh::HalfedgeHandle> edge;
  OpenMesh::VPropHandleT<Birth> birth;
  OpenMesh::MPropHandleT<int> n_calls;

  bool exist() const { return edge.is_valid(); }
};

/// Those of a mesh, if it has some.
Marks find_marks(const TriMesh& mesh);

/// The vertex across the refinement edge of a face.
OpenMesh::VertexHandle newest_vertex(const TriMesh& mesh, const Marks& marks,
                                     OpenMesh::FaceHandle face);

/// Chooses another refinement edge: the bisections that made the face or what it was a part of
/// cannot be undone any more. That the vertices forget them is more than having another newest
/// vertex: this one could be chosen again later, with other faces round the vertex.
void mark(TriMesh& mesh, const Marks& marks, OpenMesh::FaceHandle face,
          OpenMesh::HalfedgeHandle edge);

/// A strict order of the edges: the same for both half-edges of an edge. Both directions of a
/// difference have the same square, so the length needs no care. Lengths that differ by rounding
/// alone, as on symmetric surfaces, are ties.
std::tuple<float, int, int> rank(const TriMesh& mesh, OpenMesh::HalfedgeHandle halfedge);

OpenMesh::HalfedgeHandle longest_edge(const TriMesh& mesh, OpenMesh::FaceHandle face);

/// The four children round a vertex in the order of its spokes, which is that of the rim:
/// left of b, left of a, right of a, right of b.
struct Star {
  std::array<OpenMesh::HalfedgeHandle, 4> spoke,
      rim;  ///< rim[k] runs from spoke[k]'s end to the next one's
};

/// Empty if the vertex has not four triangles.
std::optional<Star> four_spokes(const TriMesh& mesh, OpenMesh::HalfedgeHandle first);

/// The star of a vertex if it is the one that its bisection left.
std::optional<Star> children(const TriMesh& mesh, const Marks& marks,
                             OpenMesh::VertexHandle vertex);

}  // namespace surf::mesh
