// Flips of edges. Private to improve().
#pragma once

#include <optional>
#include <vector>

#include "libsurf/mesh/detail/mending.h"

namespace surf::mesh {

class Flips {
 public:
  explicit Flips(Mending& work) : work_(work), mesh_(work.mesh), options_(work.options) {}

  /// Whether the edge was flipped: see improve().
  bool try_flip(OpenMesh::EdgeHandle edge);
  /// Flips until no edge asks for it; each edge's turn comes again when its triangles change.
  void flip_edges();

 private:
  /// The witnesses of the two triangles of an edge, and which of those that follow keeps each.
  struct FlipPlan {
    std::vector<Eigen::Vector3d> witnesses;
    std::vector<std::size_t> keepers;
  };

  /// What try_flip() would do; looks at the stars of the edge's ends and of their neighbours only.
  std::optional<FlipPlan> plan(OpenMesh::EdgeHandle edge) const;
  void carry_out(OpenMesh::EdgeHandle edge, const FlipPlan& plan);
  bool is_far_from_delaunay(OpenMesh::EdgeHandle edge) const;
  std::optional<double> flip_distance(const Diamond& v) const;
  bool has_corner(OpenMesh::FaceHandle face, OpenMesh::VertexHandle vertex) const;

  Mending& work_;
  TriMesh& mesh_;
  const ImproveOptions& options_;
};

}  // namespace surf::mesh
