#include "libsurf/mesh/bisection.h"

#include <fmt/format.h>

#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <cassert>
#include <tuple>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

constexpr const char* kProperty = "surf:refinement_edge";

using RefinementEdge = OpenMesh::FPropHandleT<HalfedgeHandle>;

/// Invalid if the faces carry none.
RefinementEdge find_property(const TriMesh& mesh) {
  RefinementEdge property;
  mesh.get_property_handle(property, kProperty);
  return property;
}

double squared_length(const TriMesh& mesh, HalfedgeHandle halfedge) {
  return (mesh.point(mesh.to_vertex_handle(halfedge)) -
          mesh.point(mesh.from_vertex_handle(halfedge)))
      .squaredNorm();
}

/// A strict order of the edges: the same for both half-edges of an edge. Both directions of a
/// difference have the same square, so the length needs no care.
std::tuple<double, int, int> rank(const TriMesh& mesh, HalfedgeHandle halfedge) {
  const int from = mesh.from_vertex_handle(halfedge).idx();
  const int to = mesh.to_vertex_handle(halfedge).idx();
  return {squared_length(mesh, halfedge), std::min(from, to), std::max(from, to)};
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

/// One call of bisect().
class Bisection {
 public:
  Bisection(TriMesh& mesh, const BisectionHook& hook)
      : mesh_(mesh),
        property_(find_property(mesh)),
        hook_(hook),
        is_bisected_(mesh.n_faces(), false) {}

  /// Bisects a face of the mesh before the call unless that has happened already.
  void bisect_once(FaceHandle face) {
    if (!is_bisected_[face.idx()]) bisect(face);
  }

  int n_new_vertices() const { return n_new_vertices_; }

 private:
  /// The closure: neighbours that are refined at another edge go first. Each entry of the stack is
  /// bisected once and the stack holds no face twice, so its length is bounded.
  void bisect(FaceHandle face) {
    stack_.assign(1, face);
    while (!stack_.empty()) {
      const HalfedgeHandle halfedge = mesh_.property(property_, stack_.back());
      const HalfedgeHandle opposite = mesh_.opposite_halfedge_handle(halfedge);
      const FaceHandle neighbour = mesh_.face_handle(opposite);
      if (mesh_.property(property_, neighbour) == opposite) {
        stack_.pop_back();
        split(halfedge);
      } else {
        stack_.push_back(neighbour);
        assert(stack_.size() <= mesh_.n_faces() && "refinement edges have a cycle");
      }
    }
  }

  void split(HalfedgeHandle halfedge) {
    const VertexHandle a = mesh_.from_vertex_handle(halfedge);
    const VertexHandle b = mesh_.to_vertex_handle(halfedge);
    note(mesh_.face_handle(halfedge));
    note(mesh_.opposite_face_handle(halfedge));
    const Eigen::Vector3d midpoint = 0.5 * (mesh_.point(a) + mesh_.point(b));
    const VertexHandle new_vertex = mesh_.add_vertex(midpoint);
    mesh_.split(mesh_.edge_handle(halfedge), new_vertex);
    for (const auto spoke : mesh_.voh_range(new_vertex))
      mesh_.property(property_, mesh_.face_handle(spoke)) = mesh_.next_halfedge_handle(spoke);
    ++n_new_vertices_;
    if (hook_) hook_(new_vertex, a, b);
  }

  void note(FaceHandle face) {
    if (face.idx() < static_cast<int>(is_bisected_.size())) is_bisected_[face.idx()] = true;
  }

  TriMesh& mesh_;
  RefinementEdge property_;
  const BisectionHook& hook_;
  std::vector<bool> is_bisected_;  // faces before the call
  std::vector<FaceHandle> stack_;
  int n_new_vertices_ = 0;
};

std::vector<FaceHandle> faces_with_long_edges(const TriMesh& mesh, double max_length) {
  const double limit = max_length * max_length;
  std::vector<bool> is_marked(mesh.n_faces(), false);
  for (const auto edge : mesh.edges()) {
    const HalfedgeHandle halfedge = mesh.halfedge_handle(edge, 0);
    if (squared_length(mesh, halfedge) <= limit) continue;
    is_marked[mesh.face_handle(halfedge).idx()] = true;
    is_marked[mesh.opposite_face_handle(halfedge).idx()] = true;
  }
  std::vector<FaceHandle> marked;
  for (int j = 0; j < static_cast<int>(is_marked.size()); ++j)
    if (is_marked[j]) marked.emplace_back(j);
  return marked;
}

/// Walks from each face across refinement edges; a path may end only in a pair of faces that
/// share theirs, or join an earlier path.
void check_paths_end(const TriMesh& mesh, RefinementEdge property) {
  std::vector<int> visited_from(mesh.n_faces(), -1);
  for (const auto start : mesh.faces()) {
    FaceHandle face = start;
    while (visited_from[face.idx()] < 0) {
      visited_from[face.idx()] = start.idx();
      const HalfedgeHandle opposite = mesh.opposite_halfedge_handle(mesh.property(property, face));
      const FaceHandle neighbour = mesh.face_handle(opposite);
      if (mesh.property(property, neighbour) == opposite) break;
      if (visited_from[neighbour.idx()] == start.idx())
        throw InvalidMesh(fmt::format("mesh: the refinement edges from face {} on lead in a circle",
                                      neighbour.idx()));
      face = neighbour;
    }
  }
}

}  // namespace

void mark_longest_edges(TriMesh& mesh) {
  RefinementEdge property = find_property(mesh);
  if (!property.is_valid()) mesh.add_property(property, kProperty);
  for (int j = 0; j < static_cast<int>(mesh.n_faces()); ++j)
    mesh.property(property, FaceHandle(j)) = longest_edge(mesh, FaceHandle(j));
}

bool has_refinement_edges(const TriMesh& mesh) { return find_property(mesh).is_valid(); }

HalfedgeHandle refinement_edge(const TriMesh& mesh, FaceHandle face) {
  const RefinementEdge property = find_property(mesh);
  assert(property.is_valid() && "the faces carry no refinement edges");
  return mesh.property(property, face);
}

void clear_refinement_edges(TriMesh& mesh) {
  RefinementEdge property = find_property(mesh);
  if (property.is_valid()) mesh.remove_property(property);
}

void check_refinement_edges(const TriMesh& mesh) {
  const RefinementEdge property = find_property(mesh);
  if (!property.is_valid()) return;
  for (const auto face : mesh.faces()) {
    const HalfedgeHandle halfedge = mesh.property(property, face);
    if (!halfedge.is_valid() || halfedge.idx() >= static_cast<int>(mesh.n_halfedges()) ||
        mesh.face_handle(halfedge) != face)
      throw InvalidMesh(
          fmt::format("mesh: the refinement edge of face {} is not one of its edges", face.idx()));
  }
  check_paths_end(mesh, property);
}

int bisect(TriMesh& mesh, std::span<const FaceHandle> marked, const BisectionHook& hook) {
  if (!has_refinement_edges(mesh)) mark_longest_edges(mesh);
  Bisection bisection(mesh, hook);
  for (const FaceHandle face : marked) bisection.bisect_once(face);
  return bisection.n_new_vertices();
}

int refine_long_edges(TriMesh& mesh, double max_length, RefinementEdges edges,
                      const BisectionHook& hook) {
  assert(max_length > 0);
  int n_new_vertices = 0;
  while (true) {
    const std::vector<FaceHandle> marked = faces_with_long_edges(mesh, max_length);
    if (marked.empty()) return n_new_vertices;
    if (edges == RefinementEdges::kLongest) mark_longest_edges(mesh);
    n_new_vertices += bisect(mesh, marked, hook);
  }
}

}  // namespace surf::mesh
