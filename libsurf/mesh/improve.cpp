#include "libsurf/mesh/improve.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "libsurf/base/option_checks.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/detail/collapses.h"
#include "libsurf/mesh/detail/flips.h"
#include "libsurf/mesh/detail/mending.h"
#include "libsurf/mesh/detail/plan_ahead.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

/// One call of improve().
class Improvement {
 public:
  Improvement(TriMesh& mesh, const ImproveOptions& options)
      : mesh_(mesh), options_(options), work_(mesh, options), flips_(work_), collapses_(work_) {}

  ImproveReport run() {
    for (int sweep = 0; sweep < options_.n_sweeps && !work_.is_stopped(); ++sweep) {
      const int n_before = n_changes();
      collapses_.collapse_short_edges(cos_bound_);
      if (sweep == 0 && !options_.may_coarsen.empty()) collapses_.coarsen(cos_coarsen_);
      flips_.flip_edges();
      mend_slivers();
      move_vertices();
      if (n_changes() == n_before) break;
    }
    finish();
    return work_.report;
  }

 private:
  int n_changes() const {
    return work_.report.n_collapsed + work_.report.n_flipped + work_.report.n_moved;
  }

  /// Of each face the cosine of its smallest angle; -1 of those that are gone.
  std::vector<double> sharpest_cosines() const {
    std::vector<double> out(mesh_.n_faces());
    tbb::parallel_for(tbb::blocked_range<int>(0, int(out.size()), 1024), [&](const auto& faces) {
      for (int j = faces.begin(); j < faces.end(); ++j)
        out[std::size_t(j)] =
            work_.is_deleted(FaceHandle(j)) ? -1 : angle_cosines(mesh_, FaceHandle(j)).sharpest;
    });
    return out;
  }

  /// Faces with a smaller angle than the bound, the worst first.
  std::vector<FaceHandle> poor_faces(double cos_bound) const {
    const std::vector<double> cosines = sharpest_cosines();
    std::vector<std::pair<float, int>> found;
    for (int j = 0; j < static_cast<int>(cosines.size()); ++j)
      if (cosines[j] > cos_bound && !work_.is_frozen(FaceHandle(j)))
        found.emplace_back(static_cast<float>(-cosines[j]), j);
    std::sort(found.begin(), found.end());
    std::vector<FaceHandle> faces;
    for (const auto& [unused, index] : found) faces.emplace_back(index);
    return faces;
  }

  /// From the shortest to the longest.
  std::array<EdgeHandle, 3> edges_by_length(FaceHandle face) const {
    const HalfedgeHandle h = mesh_.halfedge_handle(face), n = mesh_.next_halfedge_handle(h);
    std::array<EdgeHandle, 3> edges = {mesh_.edge_handle(h), mesh_.edge_handle(n),
                                       mesh_.edge_handle(mesh_.next_halfedge_handle(n))};
    std::sort(edges.begin(), edges.end(), [&](EdgeHandle left, EdgeHandle right) {
      return std::pair(work_.rank(left), left.idx()) < std::pair(work_.rank(right), right.idx());
    });
    return edges;
  }

  void mend_slivers() {
    for (const FaceHandle face : poor_faces(cos_bound_)) {
      if (work_.is_deleted(face) || angle_cosines(mesh_, face).sharpest <= cos_bound_) continue;
      const auto edges = edges_by_length(face);
      if (flips_.try_flip(edges[2])) continue;
      for (const EdgeHandle edge : edges)
        if (collapses_.try_collapse(edge, cos_bound_, Collapses::CollapseFor::kAngle)) break;
    }
  }

  /// Towards the centroid of the star by area and towards the mean of the neighbours, all of the
  /// way and in part, in the plane through the vertex that keeps the volume.
  static std::vector<Vector3d> places_in_plane(const StarPatch& patch, const Vector3d& z) {
    Vector3d by_area = Vector3d::Zero(), mean = Vector3d::Zero();
    double area = 0;
    for (const Corners& t : patch.before) {
      const double weight = area_normal(t[0], t[1], t[2]).norm();
      by_area += weight * (t[1] + t[2] - 2 * z) / 3;
      mean += t[1] - z;
      area += weight;
    }
    const Vector3d normal = patch.rim_normal(z);
    std::vector<Vector3d> places;
    if (!(area > 0) || !(normal.norm() > 0.01 * area)) return places;
    by_area /= area;
    mean /= static_cast<double>(patch.before.size());
    for (const Vector3d& shift : {by_area, mean})
      for (const double part : {1.0, 0.5, 0.2})
        places.push_back(z + part * (shift - normal.dot(shift) / normal.squaredNorm() * normal));
    return places;
  }

  /// Along the line on which the surface ends on a face of the box, as far as its neighbours there
  /// are from being equally far, in the direction in that face that keeps the volume.
  std::vector<Vector3d> places_along_line(VertexHandle vertex, const StarPatch& patch) const {
    const Vector3d& z = work_.point(vertex);
    Vector3d middle = Vector3d::Zero();
    int n_ends = 0;
    for (const HalfedgeHandle spoke : mesh_.voh_range(vertex)) {
      if (work_.is_on_border(mesh_.face_handle(spoke)) ==
          work_.is_on_border(mesh_.opposite_face_handle(spoke)))
        continue;
      middle += 0.5 * work_.point(mesh_.to_vertex_handle(spoke));
      ++n_ends;
    }
    const unsigned faces = options_.box->faces(z);
    if (n_ends != 2 || !std::has_single_bit(faces)) return {};
    const Vector3d of_face = options_.box->normals().row(std::countr_zero(faces)).transpose();
    const Vector3d along = of_face.cross(patch.rim_normal(z));
    if (!(along.norm() > 0.01 * patch.rim_normal(z).norm())) return {};
    const Vector3d shift = (middle - z).dot(along) / along.squaredNorm() * along;
    return {z + shift, z + 0.5 * shift, z + 0.2 * shift};
  }

  std::optional<StarPlan> plan_move(VertexHandle vertex, StarPatch& patch) const {
    patch.collect(vertex);
    // By 1 % of the angle at least, so that sweeps end.
    const double angle = std::acos(std::min(1.0, sharpest(patch.before)));
    std::vector<Vector3d> places = work_.ends_on_border(vertex)
                                       ? places_along_line(vertex, patch)
                                       : places_in_plane(patch, work_.point(vertex));
    work_.keep_on_border(vertex, vertex, places);
    const auto best = patch.best_place(places, std::cos(1.01 * angle),
                                       std::max(options_.max_length, longest_spoke(patch.before)));
    if (!best) return std::nullopt;
    return patch.plan(*best);
  }

  void move_vertices() {
    std::vector<int> vertices;
    for (const FaceHandle face : poor_faces(cos_move_))
      for (const VertexHandle vertex : mesh_.fv_range(face)) vertices.push_back(vertex.idx());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::vector<VertexHandle> moving;
    for (const int vertex : vertices)
      if (!work_.is_at_frozen(VertexHandle(vertex))) moving.emplace_back(vertex);
    plan_ahead(
        work_, moving, [](VertexHandle vertex) { return std::pair(vertex, VertexHandle()); },
        [](VertexHandle) { return true; },
        [this](VertexHandle vertex, StarPatch& patch) { return plan_move(vertex, patch); },
        [this](VertexHandle vertex, const StarPlan& planned) {
          apply(planned, vertex, work_);
          ++work_.report.n_moved;
        });
  }

  /// Each vertex whose star has changed is in one of these faces: flips and collapses leave the
  /// vertices of all faces they change in faces they have changed.
  void mark_reconnected_faces() {
    if (!has_refinement_edges(mesh_)) return;
    std::vector<FaceHandle> faces;
    for (int j = 0; j < static_cast<int>(work_.is_reconnected.size()); ++j)
      if (work_.is_reconnected[j] && !work_.is_deleted(FaceHandle(j))) faces.emplace_back(j);
    mark_longest_edges(mesh_, faces);
  }

  void finish() {
    mark_reconnected_faces();
    if (work_.report.n_collapsed > 0) collect_garbage(mesh_);
    double cosine = -1;
    for (const double sharp : sharpest_cosines()) {
      if (sharp > cos_bound_) ++work_.report.n_poor;
      cosine = std::max(cosine, sharp);
    }
    work_.report.min_angle_deg = std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
  }

  TriMesh& mesh_;
  const ImproveOptions& options_;
  const double cos_bound_ = cos_deg(options_.min_angle_deg);
  const double cos_move_ = cos_deg(options_.min_angle_deg + 10);
  const double cos_coarsen_ = cos_deg(options_.min_angle_deg + 5);
  Mending work_;
  Flips flips_;
  Collapses collapses_;
};

}  // namespace

std::string ImproveOptions::error() const {
  OptionChecks check("ImproveOptions");
  check.require(min_length >= 0, "min_length", min_length, ">= 0");
  check.require(max_length > 2 * min_length, "max_length", max_length, "> 2 * min_length");
  check.require(tolerance_mm > 0, "tolerance_mm", tolerance_mm, "> 0");
  check.require(min_angle_deg > 0 && min_angle_deg < 50, "min_angle_deg", min_angle_deg,
                "in (0, 50)");
  check.require(n_sweeps >= 0, "n_sweeps", n_sweeps, ">= 0");
  return check.error();
}

ImproveReport improve(TriMesh& mesh, const ImproveOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw std::invalid_argument(error);
  return Improvement(mesh, options).run();
}

}  // namespace surf::mesh
