// The star of a vertex, or of two that are to become one, and where its centre may go. Private to
// improve().
#pragma once

#include <optional>
#include <vector>

#include "libsurf/mesh/detail/mending.h"

namespace surf::mesh {

/// Where the centre of a star goes, and which of its faces keeps each witness then.
struct StarPlan {
  Eigen::Vector3d place;
  std::vector<OpenMesh::FaceHandle> faces;
  std::vector<Eigen::Vector3d> witnesses;
  std::vector<std::size_t> keepers;  // of the faces, for each witness
};

/// Puts a vertex where a plan of its star says.
void apply(const StarPlan& plan, OpenMesh::VertexHandle vertex, Mending& work);

/// The triangles of one or two stars before an operation, and those of the one star after it.
class StarPatch {
 public:
  explicit StarPatch(const Mending& work) : work_(work), mesh_(work.mesh), options_(work.options) {}

  /// Of a vertex, and of another that is to be joined with it.
  void collect(OpenMesh::VertexHandle vertex,
               OpenMesh::VertexHandle other = OpenMesh::VertexHandle());
  std::vector<Corners> before;              // the centre of its star is the first corner
  std::vector<double> weight;               // of `before`: 1/2 for triangles that are in both stars
  std::vector<Corners> kept;                // those of `before` that stay
  std::vector<OpenMesh::FaceHandle> faces;  // of `kept`
  std::vector<Corners> after;               // `kept` with the new place as first corner
  std::vector<Eigen::Vector3d> witnesses;   // of all faces

  void set_place(const Eigen::Vector3d& place);
  /// Sum of a x b over the rim: 6 times the gradient of the volume.
  Eigen::Vector3d rim_normal(const Eigen::Vector3d& origin) const;
  /// The place with the largest smallest angle among those allowed, if its cosine is below the
  /// bound and no spoke gets longer than max_spoke.
  std::optional<Eigen::Vector3d> best_place(const std::vector<Eigen::Vector3d>& places,
                                            double cos_bound, double max_spoke);
  StarPlan plan(const Eigen::Vector3d& place);

 private:
  void add_star(OpenMesh::VertexHandle vertex, OpenMesh::VertexHandle other, bool is_second);
  bool has_turned() const;
  bool is_near_the_old() const;

  const Mending& work_;
  const TriMesh& mesh_;
  const ImproveOptions& options_;
};

}  // namespace surf::mesh
