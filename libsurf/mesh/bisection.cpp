#include "libsurf/mesh/bisection.h"

#include <cassert>
#include <cstdint>
#include <vector>

#include "libsurf/mesh/detail/bisection_marks.h"

namespace surf::mesh {
namespace {

/// Steps of next from a half-edge to where its face begins.
std::uint8_t steps_to_start(const TriMesh& mesh, HalfedgeHandle halfedge) {
  const HalfedgeHandle start = mesh.halfedge_handle(mesh.face_handle(halfedge));
  if (start == halfedge) return 0;
  return mesh.next_halfedge_handle(halfedge) == start ? 1 : 2;
}

/// One call of bisect().
class Bisection {
 public:
  Bisection(TriMesh& mesh, const BisectionHook& hook)
      : mesh_(mesh),
        marks_(find_marks(mesh)),
        hook_(hook),
        call_(++mesh.property(marks_.n_calls)),
        is_bisected_(mesh.n_faces(), false),
        position_(mesh.n_faces(), kNotOnStack) {}

  /// Bisects a face of the mesh before the call unless that has happened already.
  void bisect_once(FaceHandle face) {
    if (!is_bisected_[face.idx()]) bisect(face);
  }

  int n_new_vertices() const { return n_new_vertices_; }

 private:
  static constexpr int kNotOnStack = -1;

  /// The closure: neighbours that are refined at another edge go first. The stack holds no face
  /// twice, so its length is bounded.
  void bisect(FaceHandle face) {
    push(face);
    while (!stack_.empty()) {
      const HalfedgeHandle halfedge = mesh_.property(marks_.edge, stack_.back());
      const HalfedgeHandle opposite = mesh_.opposite_halfedge_handle(halfedge);
      const FaceHandle neighbour = mesh_.face_handle(opposite);
      if (mesh_.property(marks_.edge, neighbour) == opposite) {
        pop();
        split(halfedge);
      } else if (position_[neighbour.idx()] == kNotOnStack) {
        push(neighbour);
      } else {
        break_cycle(position_[neighbour.idx()]);
      }
    }
  }

  void push(FaceHandle face) {
    position_[face.idx()] = static_cast<int>(stack_.size());
    stack_.push_back(face);
  }

  void pop() {
    position_[stack_.back().idx()] = kNotOnStack;
    stack_.pop_back();
  }

  /// The faces of the stack from `begin` on lead each into the next and the last into the first:
  /// the longest edge they cross becomes that of both of its faces. One of them ends the stack.
  void break_cycle(int begin) {
    const int end = static_cast<int>(stack_.size());
    int longest = begin;
    for (int k = begin + 1; k < end; ++k)
      if (rank(mesh_, mesh_.property(marks_.edge, stack_[longest])) <
          rank(mesh_, mesh_.property(marks_.edge, stack_[k])))
        longest = k;
    const HalfedgeHandle shared = mesh_.property(marks_.edge, stack_[longest]);
    const HalfedgeHandle opposite = mesh_.opposite_halfedge_handle(shared);
    mark(mesh_, marks_, mesh_.face_handle(opposite), opposite);
    const int last = longest + 1 < end ? longest : begin;
    while (static_cast<int>(stack_.size()) > last + 1) pop();
  }

  void split(HalfedgeHandle halfedge) {
    const VertexHandle from = mesh_.from_vertex_handle(halfedge);
    const VertexHandle to = mesh_.to_vertex_handle(halfedge);
    const EdgeHandle edge = mesh_.edge_handle(halfedge);
    const HalfedgeHandle ab = mesh_.halfedge_handle(edge, 0), ba = mesh_.halfedge_handle(edge, 1);
    const Birth birth{mesh_.from_vertex_handle(ab), mesh_.to_vertex_handle(ab),
                      steps_to_start(mesh_, ab), steps_to_start(mesh_, ba), call_};
    note(mesh_.face_handle(ab));
    note(mesh_.face_handle(ba));
    const Eigen::Vector3d midpoint = 0.5 * (mesh_.point(from) + mesh_.point(to));
    const VertexHandle new_vertex = mesh_.add_vertex(midpoint);
    mesh_.split(edge, new_vertex);
    assert(mesh_.from_vertex_handle(ab) == new_vertex && mesh_.to_vertex_handle(ab) == birth.b);
    mesh_.property(marks_.birth, new_vertex) = birth;
    pass_on(*four_spokes(mesh_, ab));
    position_.resize(mesh_.n_faces(), kNotOnStack);
    ++n_new_vertices_;
    if (hook_) hook_(new_vertex, from, to);
  }

  /// Gives new elements the properties of those they are a part of, and the children their marks.
  void pass_on(const Star& star) {
    const auto face = [&](int k) { return mesh_.face_handle(star.spoke[k]); };
    const HalfedgeHandle za = star.spoke[2], az = mesh_.opposite_halfedge_handle(za);
    const HalfedgeHandle zb = star.spoke[0], bz = mesh_.opposite_halfedge_handle(zb);
    mesh_.copy_all_properties(face(0), face(1));
    mesh_.copy_all_properties(face(3), face(2));
    mesh_.copy_all_properties(mesh_.edge_handle(zb), mesh_.edge_handle(za));
    mesh_.copy_all_properties(zb, az);
    mesh_.copy_all_properties(bz, za);
    for (int k = 0; k < 4; ++k) mesh_.property(marks_.edge, face(k)) = star.rim[k];
  }

  void note(FaceHandle face) {
    if (face.idx() < static_cast<int>(is_bisected_.size())) is_bisected_[face.idx()] = true;
  }

  TriMesh& mesh_;
  const Marks marks_;
  const BisectionHook& hook_;
  const int call_;
  std::vector<bool> is_bisected_;  // faces before the call
  std::vector<FaceHandle> stack_;
  std::vector<int> position_;  // of each face on the stack
  int n_new_vertices_ = 0;
};

}  // namespace

int bisect(TriMesh& mesh, std::span<const FaceHandle> marked, const BisectionHook& hook) {
  if (!has_refinement_edges(mesh)) mark_longest_edges(mesh);
  Bisection bisection(mesh, hook);
  for (const FaceHandle face : marked) bisection.bisect_once(face);
  return bisection.n_new_vertices();
}

}  // namespace surf::mesh
