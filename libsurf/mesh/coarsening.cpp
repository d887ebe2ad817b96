#include <array>
#include <functional>
#include <span>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/detail/bisection_marks.h"

namespace surf::mesh {
namespace {

/// One call of coarsen().
class Coarsening {
 public:
  Coarsening(TriMesh& mesh, const Marks& marks, const std::function<bool(VertexHandle)>& may_remove)
      : mesh_(mesh), marks_(marks), may_remove_(may_remove), is_marked_(mesh.n_faces(), false) {}

  int run(std::span<const FaceHandle> marked) {
    for (const FaceHandle face : marked) is_marked_[face.idx()] = true;
    // Stars of candidates have no face in common, so each is decided by itself.
    for (int j = 0; j < static_cast<int>(is_marked_.size()); ++j)
      if (is_marked_[j]) add_candidate(FaceHandle(j), /*is_parent=*/false);
    while (!candidates_.empty()) {
      const VertexHandle vertex = candidates_.back();
      candidates_.pop_back();
      if (!may_remove_ || may_remove_(vertex)) remove(vertex);
    }
    return n_removed_;
  }

 private:
  /// The newest vertex of a face if it can go: met from each of its faces, it is taken from one.
  void add_candidate(FaceHandle face, bool is_parent) {
    const VertexHandle vertex = newest_vertex(mesh_, marks_, face);
    const auto star = children(mesh_, marks_, vertex);
    if (!star) return;
    if (!is_parent && mesh_.face_handle(star->spoke[0]) != face) return;
    for (const HalfedgeHandle spoke : star->spoke)
      if (!is_marked_[mesh_.face_handle(spoke).idx()]) return;
    candidates_.push_back(vertex);
  }

  /// Not where a flip has joined the ends of the bisected edge meanwhile: they would have two
  /// edges.
  void remove(VertexHandle vertex) {
    const Birth birth = mesh_.property(marks_.birth, vertex);
    if (mesh_.find_halfedge(birth.a, birth.b).is_valid()) return;
    const Star star = *children(mesh_, marks_, vertex);
    const FaceHandle left = mesh_.face_handle(star.spoke[0]);
    const FaceHandle right = mesh_.face_handle(star.spoke[3]);
    unite(star, birth);
    delete_rest(star, vertex);
    ++n_removed_;
    // Parents stay marked for what the same call of bisect() had made before.
    for (const FaceHandle parent : {left, right}) {
      const Birth& older = mesh_.property(marks_.birth, newest_vertex(mesh_, marks_, parent));
      is_marked_[parent.idx()] = older.is_valid() && older.call == birth.call;
    }
    for (const FaceHandle parent : {left, right})
      if (is_marked_[parent.idx()]) add_candidate(parent, /*is_parent=*/true);
  }

  /// Makes the parents of the children that have kept their handles.
  void unite(const Star& star, const Birth& birth) {
    const HalfedgeHandle ab = star.spoke[0], ba = mesh_.opposite_halfedge_handle(ab);
    const FaceHandle left = mesh_.face_handle(ab), right = mesh_.face_handle(ba);
    mesh_.set_vertex_handle(ba, birth.a);
    give_outgoing(star.spoke[1], star.rim[1]);
    give_outgoing(star.spoke[2], ab);
    give_outgoing(star.spoke[3], star.rim[3]);
    connect(left, {ab, star.rim[0], star.rim[1]}, birth.start_left);
    connect(right, {ba, star.rim[2], star.rim[3]}, birth.start_right);
  }

  void connect(FaceHandle face, const std::array<HalfedgeHandle, 3>& sides, int start) {
    for (int k = 0; k < 3; ++k) {
      mesh_.set_next_halfedge_handle(sides[k], sides[(k + 1) % 3]);
      mesh_.set_face_handle(sides[k], face);
    }
    mesh_.set_halfedge_handle(face, sides[start]);
    mesh_.property(marks_.edge, face) = sides[0];
  }

  /// The end of a spoke that goes must not begin with it.
  void give_outgoing(HalfedgeHandle spoke, HalfedgeHandle other) {
    const VertexHandle end = mesh_.to_vertex_handle(spoke);
    if (mesh_.halfedge_handle(end) == mesh_.opposite_halfedge_handle(spoke))
      mesh_.set_halfedge_handle(end, other);
  }

  void delete_rest(const Star& star, VertexHandle vertex) {
    mesh_.status(vertex).set_deleted(true);
    mesh_.status(mesh_.face_handle(star.spoke[1])).set_deleted(true);
    mesh_.status(mesh_.face_handle(star.spoke[2])).set_deleted(true);
    for (int k = 1; k < 4; ++k) mesh_.status(mesh_.edge_handle(star.spoke[k])).set_deleted(true);
  }

  TriMesh& mesh_;
  const Marks marks_;
  const std::function<bool(VertexHandle)>& may_remove_;
  std::vector<bool> is_marked_;
  std::vector<VertexHandle> candidates_;
  int n_removed_ = 0;
};

}  // namespace

int coarsen(TriMesh& mesh, std::span<const FaceHandle> marked,
            const std::function<bool(VertexHandle)>& may_remove) {
  const Marks marks = find_marks(mesh);
  if (!marks.exist()) return 0;
  const int n_removed = Coarsening(mesh, marks, may_remove).run(marked);
  if (n_removed > 0) collect_garbage(mesh);
  return n_removed;
}

}  // namespace surf::mesh
