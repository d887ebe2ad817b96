#include "libsurf/mesh/bisection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

/// What it takes to undo the bisection that made a vertex. Its parents' handles need no place here:
/// they are those of the children at the half of the edge that has kept its handle.
struct Birth {
  /// Ends of the halved edge; the half at b has the handle of the whole. Invalid: never born by
  /// bisection, or the star has changed otherwise since.
  VertexHandle a, b;
  /// Steps from the halved edge to where the parent's row began; left and right of a -> b.
  std::uint8_t start_left = 0, start_right = 0;
  int call = 0;  ///< of bisect(), counted from the first marking on

  bool is_valid() const { return a.is_valid(); }
};

/// The marks that a mesh carries, all of them or none.
struct Marks {
  OpenMesh::FPropHandleT<HalfedgeHandle> edge;
  OpenMesh::VPropHandleT<Birth> birth;
  OpenMesh::MPropHandleT<int> n_calls;

  bool exist() const { return edge.is_valid(); }
};

constexpr const char* kEdgeName = "surf:refinement_edge";
constexpr const char* kBirthName = "surf:bisection";
constexpr const char* kCallsName = "surf:n_bisection_calls";

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

/// Chooses another refinement edge: the bisections that made the face or what it was a part of
/// cannot be undone any more. That the vertices forget them is more than having another newest
/// vertex: this one could be chosen again later, with other faces round the vertex.
void mark(TriMesh& mesh, const Marks& marks, FaceHandle face, HalfedgeHandle edge) {
  mesh.property(marks.edge, face) = edge;
  for (const VertexHandle vertex : mesh.fv_range(face))
    mesh.property(marks.birth, vertex) = Birth();
}

double squared_length(const TriMesh& mesh, HalfedgeHandle halfedge) {
  return (mesh.point(mesh.to_vertex_handle(halfedge)) -
          mesh.point(mesh.from_vertex_handle(halfedge)))
      .squaredNorm();
}

/// A strict order of the edges: the same for both half-edges of an edge. Both directions of a
/// difference have the same square, so the length needs no care. Lengths that differ by rounding
/// alone, as on symmetric surfaces, are ties.
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

/// Steps of next from a half-edge to where its face begins.
std::uint8_t steps_to_start(const TriMesh& mesh, HalfedgeHandle halfedge) {
  const HalfedgeHandle start = mesh.halfedge_handle(mesh.face_handle(halfedge));
  if (start == halfedge) return 0;
  return mesh.next_halfedge_handle(halfedge) == start ? 1 : 2;
}

/// The four children round a vertex in the order of its spokes, which is that of the rim:
/// left of b, left of a, right of a, right of b.
struct Star {
  std::array<HalfedgeHandle, 4> spoke, rim;  ///< rim[k] runs from spoke[k]'s end to the next one's
};

/// Empty if the vertex has not four triangles.
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

/// The star of a vertex if it is the one that its bisection left.
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

/// Which edge the closure takes as that of a face.
enum class EdgeChoice {
  kMarked,
  kLongest  ///< marks it first if the refinement edge is shorter
};

/// One call of bisect().
class Bisection {
 public:
  Bisection(TriMesh& mesh, const BisectionHook& hook, EdgeChoice choice)
      : mesh_(mesh),
        marks_(find_marks(mesh)),
        hook_(hook),
        choice_(choice),
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
    choose_edge(face);
    push(face);
    while (!stack_.empty()) {
      const HalfedgeHandle halfedge = mesh_.property(marks_.edge, stack_.back());
      const HalfedgeHandle opposite = mesh_.opposite_halfedge_handle(halfedge);
      const FaceHandle neighbour = mesh_.face_handle(opposite);
      choose_edge(neighbour);
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

  /// Children are left alone, and so is a face where a cycle was broken: the edge it got there is
  /// not shorter than its own was.
  void choose_edge(FaceHandle face) {
    if (choice_ == EdgeChoice::kMarked || !is_old(face)) return;
    const HalfedgeHandle longest = longest_edge(mesh_, face);
    if (std::get<0>(rank(mesh_, longest)) >
        std::get<0>(rank(mesh_, mesh_.property(marks_.edge, face))))
      mark(mesh_, marks_, face, longest);
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

  /// Whether the face is one of before the call.
  bool is_old(FaceHandle face) const {
    return face.idx() < static_cast<int>(is_bisected_.size()) && !is_bisected_[face.idx()];
  }

  void note(FaceHandle face) {
    if (face.idx() < static_cast<int>(is_bisected_.size())) is_bisected_[face.idx()] = true;
  }

  TriMesh& mesh_;
  const Marks marks_;
  const BisectionHook& hook_;
  const EdgeChoice choice_;
  const int call_;
  std::vector<bool> is_bisected_;  // faces before the call
  std::vector<FaceHandle> stack_;
  std::vector<int> position_;  // of each face on the stack
  int n_new_vertices_ = 0;
};

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

  void remove(VertexHandle vertex) {
    const Birth birth = mesh_.property(marks_.birth, vertex);
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

int bisect(TriMesh& mesh, std::span<const FaceHandle> marked, const BisectionHook& hook,
           EdgeChoice choice) {
  if (!has_refinement_edges(mesh)) mark_longest_edges(mesh);
  Bisection bisection(mesh, hook, choice);
  for (const FaceHandle face : marked) bisection.bisect_once(face);
  return bisection.n_new_vertices();
}

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

/// New handles by old index, invalid where deleted; `old_index` has travelled with the elements.
template <class Handle, class Property>
std::vector<Handle> new_handles(const TriMesh& mesh, Property old_index, std::size_t n_old,
                                std::size_t n_new) {
  std::vector<Handle> handles(n_old);
  for (int k = 0; k < static_cast<int>(n_new); ++k)
    handles[mesh.property(old_index, Handle(k))] = Handle(k);
  return handles;
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
    mesh.garbage_collection();
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
  mesh.garbage_collection();
  renumber(mesh, marks, new_handles<VertexHandle>(mesh, old_vertex, n_vertices, mesh.n_vertices()),
           new_handles<HalfedgeHandle>(mesh, old_halfedge, n_halfedges, mesh.n_halfedges()));
  mesh.remove_property(old_vertex);
  mesh.remove_property(old_halfedge);
}

int bisect(TriMesh& mesh, std::span<const FaceHandle> marked, const BisectionHook& hook) {
  return bisect(mesh, marked, hook, EdgeChoice::kMarked);
}

bool is_removable(const TriMesh& mesh, VertexHandle vertex) {
  const Marks marks = find_marks(mesh);
  return marks.exist() && children(mesh, marks, vertex).has_value();
}

std::array<VertexHandle, 2> bisected_edge(const TriMesh& mesh, VertexHandle vertex) {
  const Birth& birth = mesh.property(find_marks(mesh).birth, vertex);
  return {birth.a, birth.b};
}

int coarsen(TriMesh& mesh, std::span<const FaceHandle> marked,
            const std::function<bool(VertexHandle)>& may_remove) {
  const Marks marks = find_marks(mesh);
  if (!marks.exist()) return 0;
  const int n_removed = Coarsening(mesh, marks, may_remove).run(marked);
  if (n_removed > 0) collect_garbage(mesh);
  return n_removed;
}

int bisect_at_longest_edges(TriMesh& mesh, std::span<const FaceHandle> marked,
                            const BisectionHook& hook) {
  return bisect(mesh, marked, hook, EdgeChoice::kLongest);
}

int refine_long_edges(TriMesh& mesh, double max_length, const BisectionHook& hook) {
  assert(max_length > 0);
  int n_new_vertices = 0;
  while (true) {
    const std::vector<FaceHandle> marked = faces_with_long_edges(mesh, max_length);
    if (marked.empty()) return n_new_vertices;
    n_new_vertices += bisect_at_longest_edges(mesh, marked, hook);
  }
}

}  // namespace surf::mesh
