// What the operations of improve() share. Private to improve().
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "libsurf/mesh/detail/patch_shape.h"
#include "libsurf/mesh/improve.h"

namespace surf::mesh {

/// Around an edge: faces (a, b, c) and (b, a, d).
struct Diamond {
  OpenMesh::HalfedgeHandle halfedge, opposite;
  OpenMesh::VertexHandle a, b, c, d;
};

/// A mesh that is being improved.
///
/// Witnesses are the vertices and midpoints of edges of the surface at the start. Each is kept by
/// a face close to it; faces that no operation has touched keep their own without a list.
class Mending {
 public:
  /// Both must outlive this object.
  Mending(TriMesh& mesh, const ImproveOptions& options);

  TriMesh& mesh;
  const ImproveOptions& options;
  ImproveReport report;
  std::vector<bool> is_reconnected;  ///< faces that a flip or a collapse has changed

  const Eigen::Vector3d& point(OpenMesh::VertexHandle vertex) const { return mesh.point(vertex); }

  double length(OpenMesh::EdgeHandle edge) const {
    const OpenMesh::HalfedgeHandle h = mesh.halfedge_handle(edge, 0);
    return (point(mesh.to_vertex_handle(h)) - point(mesh.from_vertex_handle(h))).norm();
  }

  /// For sorting: lengths that differ by rounding alone, as on symmetric surfaces, are ties.
  float rank(OpenMesh::EdgeHandle edge) const { return static_cast<float>(length(edge)); }

  bool is_stopped() const { return options.stop.stop_requested(); }
  bool is_deleted(OpenMesh::EdgeHandle edge) const { return mesh.status(edge).deleted(); }
  bool is_deleted(OpenMesh::FaceHandle face) const { return mesh.status(face).deleted(); }

  bool is_frozen(OpenMesh::FaceHandle face) const {
    return !options.frozen.empty() && options.frozen[face.idx()];
  }
  /// Whether it is there, and neither of its faces is frozen.
  bool may_change(OpenMesh::EdgeHandle edge) const {
    return !is_deleted(edge) && !is_frozen(mesh.face_handle(mesh.halfedge_handle(edge, 0))) &&
           !is_frozen(mesh.face_handle(mesh.halfedge_handle(edge, 1)));
  }
  /// Those that may change and are wanted, in their order; they are looked at on all cores.
  template <class IsWanted>
  std::vector<OpenMesh::EdgeHandle> edges_that(const IsWanted& is_wanted) const {
    std::vector<char> flags(mesh.n_edges());
    tbb::parallel_for(tbb::blocked_range<int>(0, int(flags.size()), 1024), [&](const auto& edges) {
      for (int n = edges.begin(); n < edges.end(); ++n) {
        const OpenMesh::EdgeHandle edge(n);
        flags[std::size_t(n)] = may_change(edge) && is_wanted(edge);
      }
    });
    std::vector<OpenMesh::EdgeHandle> out;
    for (int n = 0; n < int(flags.size()); ++n)
      if (flags[std::size_t(n)]) out.emplace_back(n);
    return out;
  }
  bool is_at_frozen(OpenMesh::VertexHandle vertex) const {
    if (options.frozen.empty()) return false;
    for (const OpenMesh::FaceHandle face : mesh.vf_range(vertex))
      if (is_frozen(face)) return true;
    return false;
  }

  /// Whether a face lies in one of the box's. @pre  there is a box
  bool is_on_border(OpenMesh::FaceHandle face) const;
  /// Whether a vertex has faces on the box's border and others.
  bool ends_on_border(OpenMesh::VertexHandle vertex) const;
  /// Places for what stands for both vertices: in the faces of the box that they lie on, and where
  /// the surface ends on the border if one of them does.
  void keep_on_border(OpenMesh::VertexHandle a, OpenMesh::VertexHandle b,
                      std::vector<Eigen::Vector3d>& places) const;

  Diamond diamond(OpenMesh::EdgeHandle edge) const;
  /// To and from where its first half-edge leads.
  std::pair<OpenMesh::VertexHandle, OpenMesh::VertexHandle> ends(OpenMesh::EdgeHandle edge) const {
    const OpenMesh::HalfedgeHandle h = mesh.halfedge_handle(edge, 0);
    return {mesh.to_vertex_handle(h), mesh.from_vertex_handle(h)};
  }

  void add_witnesses(OpenMesh::FaceHandle face, std::vector<Eigen::Vector3d>& witnesses) const;
  bool are_witnesses_near(const std::vector<Eigen::Vector3d>& witnesses,
                          const std::vector<Corners>& patch) const;
  /// The faces keep these witnesses in place of theirs: witnesses[n] goes to faces[keepers[n]].
  void hand_over(const std::vector<Eigen::Vector3d>& witnesses,
                 const std::vector<std::size_t>& keepers,
                 const std::vector<OpenMesh::FaceHandle>& faces);

  /// Counts a change of the star of a vertex, which is one of those of its neighbours, too.
  void note_change_at(OpenMesh::VertexHandle vertex);
  int n_changes() const { return n_changes_; }
  /// Of the star of a vertex: so many changes there were then.
  int last_change_at(OpenMesh::VertexHandle vertex) const {
    return changed_[std::size_t(vertex.idx())];
  }
  /// Whether the star of a vertex or of a neighbour has changed after so many changes.
  bool has_changed_round(OpenMesh::VertexHandle vertex, int n_changes) const;

 private:
  int n_changes_ = 0;
  std::vector<int> changed_;  // of the vertices: the last change
  std::vector<std::optional<std::vector<Eigen::Vector3d>>>
      witnesses_;  // of faces that were touched
};

}  // namespace surf::mesh
