#include "libsurf/mesh/detail/bisection_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <span>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"

namespace surf::mesh {
namespace {

constexpr const char* kEdgeName = "surf:refinement_edge";
constexpr const char* kBirthName = "surf:bisection";
constexpr const char* kCallsName = "surf:n_bisection_calls";

double squared_length(const TriMesh& mesh, HalfedgeHandle halfedge) {
  return (mesh.point(mesh.to_vertex_handle(halfedge)) -
          mesh.point(mesh.from_vertex_handle(halfedge)))
      .squaredNorm();
}

/// New handles by old index, invalid where deleted; `old_index` has travelled with the elements.
template <class Handle, class Property>
std::vector<Handle> new_handles(const TriMesh& mesh, Property old_index, std::size_t n_old,
                                std::size_t n_new) {
  std::vector<Handle> handles(n_old);
  for (int k = 0; k < static_cast<int>(n_new); ++k)
    handles[mesh.property(old_index, Handle(k))] = Handle(k);
  return handles;
}

/// mesh.garbage_collection(), compiled here: Debian's library has its assertions on, which compare
/// the names of types at every flag (2.7 % of the wall time of most of a trunk).
void compact(TriMesh& mesh) {
  std::array<VertexHandle*, 0> vertices;
  std::array<HalfedgeHandle*, 0> halfedges;
  std::array<FaceHandle*, 0> faces;
  mesh.garbage_collection(vertices, halfedges, faces);
}

void renumber(TriMesh& mesh, const Marks& marks, const std::vector<VertexHandle>& vertices,
              const std::vector<HalfedgeHandle>& halfedges) {
  for (int j = 0; j < static_cast<int>(mesh.n_faces()); ++j) {
    HalfedgeHandle& edge = mesh.property(marks.edge, FaceHandle(j));
    edge = halfedges[edge.idx()];
  }
  for (int i = 0; i < static_cast<int>(mesh.n_vertices()); ++i) {
    Birth& birth = mesh.property(marks.birth, VertexHandle(i));
    if (!birth.is_valid()) continue;
    birth.a = vertices[birth.a.idx()];
    birth.b = vertices[birth.b.idx()];
    if (!birth.a.is_valid() || !birth.b.is_valid()) birth = Birth();
  }
}

}  // namespace

Marks find_marks(const TriMesh& mesh) {
  Marks marks;
  mesh.get_property_handle(marks.edge, kEdgeName);
  mesh.get_property_handle(marks.birth, kBirthName);
  mesh.get_property_handle(marks.n_calls, kCallsName);
  return marks;
}

VertexHandle newest_vertex(const TriMesh& mesh, const Marks& marks, FaceHandle face) {
  return mesh.to_vertex_handle(mesh.next_halfedge_handle(mesh.property(marks.edge, face)));
}

void mark(TriMesh& mesh, const Marks& marks, FaceHandle face, HalfedgeHandle edge) {
  mesh.property(marks.edge, face) = edge;
  for (const VertexHandle vertex : mesh.fv_range(face))
    mesh.property(marks.birth, vertex) = Birth();
}

std::tuple<float, int, int> rank(const TriMesh& mesh, HalfedgeHandle halfedge) {
  const int from = mesh.from_vertex_handle(halfedge).idx();
  const int to = mesh.to_vertex_handle(halfedge).idx();
  return {static_cast<float>(squared_length(mesh, halfedge)), std::min(from, to),
          std::max(from, to)};
}

HalfedgeHandle longest_edge(const TriMesh& mesh, FaceHandle face) {
  const HalfedgeHandle first = mesh.halfedge_handle(face);
  const HalfedgeHandle second = mesh.next_halfedge_handle(first);
  const HalfedgeHandle third = mesh.next_halfedge_handle(second);
  HalfedgeHandle longest = first;
  for (const HalfedgeHandle other : {second, third})
    if (rank(mesh, longest) < rank(mesh, other)) longest = other;
  return longest;
}

std::optional<Star> four_spokes(const TriMesh& mesh, HalfedgeHandle first) {
  Star star;
  HalfedgeHandle spoke = first;
  for (int k = 0; k < 4; ++k) {
    star.spoke[k] = spoke;
    star.rim[k] = mesh.next_halfedge_handle(spoke);
    spoke = mesh.opposite_halfedge_handle(mesh.next_halfedge_handle(star.rim[k]));
    if (spoke == first && k < 3) return std::nullopt;
  }
  return spoke == first ? std::optional(star) : std::nullopt;
}

std::optional<Star> children(const TriMesh& mesh, const Marks& marks, VertexHandle vertex) {
  const Birth& birth = mesh.property(marks.birth, vertex);
  if (!birth.is_valid()) return std::nullopt;
  std::optional<Star> star = four_spokes(mesh, mesh.halfedge_handle(vertex));
  if (!star) return std::nullopt;
  for (int k = 0; k < 4; ++k)
    if (mesh.property(marks.edge, mesh.face_handle(star->spoke[k])) != star->rim[k])
      return std::nullopt;
  int to_b = 0;
  while (to_b < 4 && mesh.to_vertex_handle(star->spoke[to_b]) != birth.b) ++to_b;
  if (to_b == 4) return std::nullopt;
  std::rotate(star->spoke.begin(), star->spoke.begin() + to_b, star->spoke.end());
  std::rotate(star->rim.begin(), star->rim.begin() + to_b, star->rim.end());
  return mesh.to_vertex_handle(star->spoke[2]) == birth.a ? star : std::nullopt;
}

void mark_longest_edges(TriMesh& mesh) {
  clear_refinement_edges(mesh);
  Marks marks;
  mesh.add_property(marks.edge, kEdgeName);
  mesh.add_property(marks.birth, kBirthName);
  mesh.add_property(marks.n_calls, kCallsName);
  mesh.property(marks.n_calls) = 0;
  for (int j = 0; j < static_cast<int>(mesh.n_faces()); ++j)
    mesh.property(marks.edge, FaceHandle(j)) = longest_edge(mesh, FaceHandle(j));
}

void mark_longest_edges(TriMesh& mesh, std::span<const FaceHandle> faces) {
  const Marks marks = find_marks(mesh);
  assert(marks.exist() && "the faces carry no refinement edges");
  for (const FaceHandle face : faces) mark(mesh, marks, face, longest_edge(mesh, face));
}

bool has_refinement_edges(const TriMesh& mesh) { return find_marks(mesh).exist(); }

HalfedgeHandle refinement_edge(const TriMesh& mesh, FaceHandle face) {
  const Marks marks = find_marks(mesh);
  assert(marks.exist() && "the faces carry no refinement edges");
  return mesh.property(marks.edge, face);
}

void clear_refinement_edges(TriMesh& mesh) {
  Marks marks = find_marks(mesh);
  if (!marks.exist()) return;
  mesh.remove_property(marks.edge);
  mesh.remove_property(marks.birth);
  mesh.remove_property(marks.n_calls);
}

void check_refinement_edges(const TriMesh& mesh) {
  const Marks marks = find_marks(mesh);
  if (!marks.exist()) return;
  for (const auto face : mesh.faces()) {
    const HalfedgeHandle halfedge = mesh.property(marks.edge, face);
    if (!halfedge.is_valid() || halfedge.idx() >= static_cast<int>(mesh.n_halfedges()) ||
        mesh.face_handle(halfedge) != face)
      throw InvalidMesh(
          fmt::format("mesh: the refinement edge of face {} is not one of its edges", face.idx()));
  }
  const int n_vertices = static_cast<int>(mesh.n_vertices());
  for (const auto vertex : mesh.vertices()) {
    const Birth& birth = mesh.property(marks.birth, vertex);
    if (birth.a.is_valid() != birth.b.is_valid() || birth.a.idx() >= n_vertices ||
        birth.b.idx() >= n_vertices)
      throw InvalidMesh(
          fmt::format("mesh: vertex {} was born on edge ({}, {}), but there are {} vertices",
                      vertex.idx(), birth.a.idx(), birth.b.idx(), n_vertices));
  }
}

void collect_garbage(TriMesh& mesh) {
  const Marks marks = find_marks(mesh);
  if (!marks.exist()) {
    compact(mesh);
    return;
  }
  OpenMesh::VPropHandleT<int> old_vertex;
  OpenMesh::HPropHandleT<int> old_halfedge;
  mesh.add_property(old_vertex);
  mesh.add_property(old_halfedge);
  const std::size_t n_vertices = mesh.n_vertices(), n_halfedges = mesh.n_halfedges();
  for (int i = 0; i < static_cast<int>(n_vertices); ++i)
    mesh.property(old_vertex, VertexHandle(i)) = i;
  for (int h = 0; h < static_cast<int>(n_halfedges); ++h)
    mesh.property(old_halfedge, HalfedgeHandle(h)) = h;
  compact(mesh);
  renumber(mesh, marks, new_handles<VertexHandle>(mesh, old_vertex, n_vertices, mesh.n_vertices()),
           new_handles<HalfedgeHandle>(mesh, old_halfedge, n_halfedges, mesh.n_halfedges()));
  mesh.remove_property(old_vertex);
  mesh.remove_property(old_halfedge);
}

bool is_removable(const TriMesh& mesh, VertexHandle vertex) {
  const Marks marks = find_marks(mesh);
  return marks.exist() && children(mesh, marks, vertex).has_value();
}

std::array<VertexHandle, 2> bisected_edge(const TriMesh& mesh, VertexHandle vertex) {
  const Birth& birth = mesh.property(find_marks(mesh).birth, vertex);
  return {birth.a, birth.b};
}

}  // namespace surf::mesh
