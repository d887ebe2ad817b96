// The evolving surface: half-edges in OpenMesh, and the way to plain arrays and back.
#pragma once

#include <Eigen/Dense>
// The adaptor for Eigen vectors specialises the first and is used by the last.
// clang-format off
#include <OpenMesh/Core/Utils/vector_traits.hh>
#include <OpenMesh/Core/Geometry/EigenVectorT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
// clang-format on

#include "libsurf/base/types.h"

/// @cond
// New points are zero, and what properties have of new vertices, which are resized: the general
// template leaves them uninitialised.
template <>
inline void OpenMesh::PropertyT<Eigen::Vector3d>::push_back() {
  data_.push_back(Eigen::Vector3d::Zero());
}
template <>
inline void OpenMesh::PropertyT<Eigen::Vector3d>::resize(std::size_t n) {
  data_.resize(n, Eigen::Vector3d::Zero());
}
/// @endcond

namespace surf::mesh {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

struct TriMeshTraits : OpenMesh::DefaultTraits {
  using Point = Eigen::Vector3d;
  using Normal = Eigen::Vector3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};

/// A closed triangle surface, points in world mm. Functions that take one keep it closed,
/// 2-manifold and consistently oriented.
using TriMesh = OpenMesh::TriMesh_ArrayKernelT<TriMeshTraits>;

/// Half-edges of a surface in arrays; vertex i and face j have the handles i and j, and
/// halfedge_handle(j) begins at the first vertex of row j. O(n log n) in time.
/// @throws InvalidMesh  a coordinate is NaN or Inf, an index is out of range, a triangle names
///                      a vertex twice, a vertex is in no triangle, an edge has not exactly two
///                      triangles that run through it in opposite directions, or the triangles
///                      of a vertex are not one closed fan of at least three
TriMesh to_mesh(const Triangles& surface);

/// The arrays of a mesh without garbage: rows in the order of the handles.
Triangles to_triangles(const TriMesh& mesh);

/// Vertex positions, (n_vertices, 3) [mm].
Points<3> points(const TriMesh& mesh);

/// Vertex indices of the faces, (n_faces, 3), from the start of halfedge_handle(face) on.
Elements<3> elements(const TriMesh& mesh);

/// Moves all vertices. @pre points.rows() == n_vertices
void set_points(TriMesh& mesh, const Points<3>& points);

/// All invariants of an evolving surface: no garbage, half-edges that agree with each other,
/// everything to_mesh() asks for (so no hanging node either), and, where faces carry
/// refinement edges (bisection.h), each is an edge of its face.
/// O(n log n): for tests and assertions.
/// @throws InvalidMesh  with the first place that breaks an invariant
void check_mesh(const TriMesh& mesh);

}  // namespace surf::mesh
