// Collapses of edges. Private to improve().
#pragma once

#include <optional>
#include <vector>

#include "libsurf/mesh/detail/mending.h"
#include "libsurf/mesh/detail/star_patch.h"

namespace surf::mesh {

class Collapses {
 public:
  explicit Collapses(Mending& work)
      : work_(work), mesh_(work.mesh), options_(work.options), patch_(work) {}

  /// What a collapse is for: to remove a short edge, a sharp angle, or what is finer than it need
  /// be.
  enum class CollapseFor { kLength, kAngle, kCoarseness };

  /// Collapses the edge if the smallest angle of what is left has a cosine below the bound.
  bool try_collapse(OpenMesh::EdgeHandle edge, double cos_bound, CollapseFor aim);
  /// Those below the least length, the shortest first.
  void collapse_short_edges(double cos_bound);
  /// Those within what may be coarsened.
  void coarsen(double cos_bound);

 private:
  /// What try_collapse() would do if the link condition holds, which carry_out() asks; looks at the
  /// stars of the edge's ends and of their neighbours only.
  std::optional<StarPlan> plan(OpenMesh::EdgeHandle edge, double cos_bound, CollapseFor aim,
                               StarPatch& patch) const;
  bool carry_out(OpenMesh::EdgeHandle edge, const StarPlan& plan);
  bool leaves_valences(OpenMesh::EdgeHandle edge) const;
  static void keep_volume(const StarPatch& patch, std::vector<Eigen::Vector3d>& places);
  double variation(const StarPatch& patch) const;
  Eigen::Vector3d normal_beyond_rim(const StarPatch& patch, std::size_t k) const;
  bool is_star_flagged(const std::vector<char>& flags, OpenMesh::VertexHandle vertex) const;

  Mending& work_;
  TriMesh& mesh_;
  const ImproveOptions& options_;
  StarPatch patch_;
};

}  // namespace surf::mesh
