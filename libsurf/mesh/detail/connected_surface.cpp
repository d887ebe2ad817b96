#include "libsurf/mesh/detail/connected_surface.h"

namespace surf::mesh {
namespace {

/// The face across the side of each corner and the next one, in the order of elements().
Elements<3> neighbours(const TriMesh& mesh) {
  Elements<3> out(mesh.n_faces(), 3);
  for (int t = 0; t < out.rows(); ++t) {
    auto side = mesh.halfedge_handle(OpenMesh::FaceHandle(t));
    for (int i = 0; i < 3; ++i, side = mesh.next_halfedge_handle(side))
      out(t, i) = mesh.face_handle(mesh.opposite_halfedge_handle(side)).idx();
  }
  return out;
}

}  // namespace

ConnectedSurface::ConnectedSurface(const TriMesh& mesh)
    : triangles(to_triangles(mesh)),
      stars(triangles.elements, triangles.points.rows()),
      across(neighbours(mesh)) {}

}  // namespace surf::mesh
