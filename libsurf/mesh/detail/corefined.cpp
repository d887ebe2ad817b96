#include "libsurf/mesh/detail/corefined.h"

#include <CGAL/Polygon_mesh_processing/corefinement.h>

#include <algorithm>
#include <array>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

namespace Pmp = CGAL::Polygon_mesh_processing;

/// The same mesh with its vertices in the order of their places and its faces in that of their
/// vertices. CGAL numbers new ones as it finds the intersections, and that order depends on
/// addresses in memory where bounding boxes begin at the same place, as those of what lies on a
/// face do.
CutMesh in_order(const CutMesh& mesh) {
  std::vector<CutMesh::Vertex_index> order(mesh.vertices().begin(), mesh.vertices().end());
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return mesh.point(a) < mesh.point(b); });
  CutMesh out;
  std::vector<CutMesh::Vertex_index> place(mesh.num_vertices());
  for (const auto vertex : order) place[vertex] = out.add_vertex(mesh.point(vertex));
  std::vector<std::array<CutMesh::Vertex_index, 3>> faces;
  for (const auto face : mesh.faces()) {
    std::array<CutMesh::Vertex_index, 3> corners;
    auto corner = corners.begin();
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
      *corner++ = place[vertex];
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    faces.push_back(corners);
  }
  std::sort(faces.begin(), faces.end());
  for (const auto& [a, b, c] : faces)
    if (out.add_face(a, b, c) == CutMesh::null_face()) return mesh;
  return out;
}

/// One call for both, which only differ in the place of `out`: its templates take a minute.
bool corefined(CutMesh& first, CutMesh& second, Pmp::Corefinement::Boolean_operation_type kind,
               CutMesh& out) {
  std::array<boost::optional<CutMesh*>, 4> outputs;
  outputs[kind] = &out;
  try {
    const bool is_manifold = Pmp::corefine_and_compute_boolean_operations(
        first, second, outputs, CGAL::parameters::throw_on_self_intersection(true))[kind];
    if (is_manifold) out = in_order(out);
    return is_manifold;
  } catch (const Pmp::Corefinement::Self_intersection_exception& error) {
    throw InvalidMesh(error.what());
  }
}

}  // namespace

bool intersect(CutMesh& first, CutMesh& second, CutMesh& out) {
  return corefined(first, second, Pmp::Corefinement::INTERSECTION, out);
}

bool subtract(CutMesh& first, CutMesh& second, CutMesh& out) {
  return corefined(first, second, Pmp::Corefinement::TM1_MINUS_TM2, out);
}

}  // namespace surf::mesh
