#include "libsurf/mesh/detail/collapses.h"

#include <algorithm>
#include <cassert>
#include <optional>
#include <utility>

#include "libsurf/base/products.h"
#include "libsurf/mesh/detail/plan_ahead.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

double cone(const Vector3d& apex, const Corners& t) {
  return triple(t[0] - apex, t[1] - apex, t[2] - apex);
}

/// The shortest first.
std::vector<EdgeHandle> by_rank(const Mending& work, const std::vector<EdgeHandle>& edges) {
  std::vector<std::pair<float, int>> ranked;
  for (const EdgeHandle edge : edges) ranked.emplace_back(work.rank(edge), edge.idx());
  std::sort(ranked.begin(), ranked.end());
  std::vector<EdgeHandle> out;
  for (const auto& [unused, index] : ranked) out.emplace_back(index);
  return out;
}

}  // namespace

/// Puts places where the volume is that of the two stars: along the rim's normal.
void Collapses::keep_volume(const StarPatch& patch, std::vector<Vector3d>& places) {
  for (Vector3d& place : places) {
    double volume = 0;  // 6 times that of the stars' cones from the place
    for (std::size_t k = 0; k < patch.before.size(); ++k)
      volume += patch.weight[k] * cone(place, patch.before[k]);
    const Vector3d normal = patch.rim_normal(place);
    if (normal.squaredNorm() > 0) place += volume / normal.squaredNorm() * normal;
  }
}

bool Collapses::leaves_valences(EdgeHandle edge) const {
  const Diamond v = work_.diamond(edge);
  return mesh_.valence(v.c) > 3 && mesh_.valence(v.d) > 3 &&
         mesh_.valence(v.a) + mesh_.valence(v.b) >= 7;
}

std::optional<StarPlan> Collapses::plan(EdgeHandle edge, double cos_bound, CollapseFor aim,
                                        StarPatch& patch) const {
  const auto [kept, removed] = work_.ends(edge);
  if (work_.is_at_frozen(kept) || work_.is_at_frozen(removed) || !leaves_valences(edge))
    return std::nullopt;
  patch.collect(kept, removed);
  const Vector3d &from = work_.point(removed), &to = work_.point(kept);
  std::vector<Vector3d> places = {0.5 * (from + to), from, to};
  keep_volume(patch, places);
  work_.keep_on_border(removed, kept, places);
  const double before = sharpest(patch.before);
  const double bound = aim == CollapseFor::kAngle    ? before
                       : aim == CollapseFor::kLength ? std::max(before, cos_bound)
                                                     : cos_bound;
  const auto best = patch.best_place(places, bound, options_.max_length);
  if (!best) return std::nullopt;
  // best_place() leaves the patch there.
  if (aim == CollapseFor::kCoarseness && variation(patch) > options_.max_variation_mm)
    return std::nullopt;
  return patch.plan(*best);
}

bool Collapses::carry_out(EdgeHandle edge, const StarPlan& plan) {
  const HalfedgeHandle halfedge = mesh_.halfedge_handle(edge, 0);
  // It sets flags of vertices, so that it is not for several threads.
  if (!mesh_.is_collapse_ok(halfedge)) return false;
  const VertexHandle kept = mesh_.to_vertex_handle(halfedge);
  mesh_.collapse(halfedge);
  for (const FaceHandle face : plan.faces) work_.is_reconnected[face.idx()] = true;
  apply(plan, kept, work_);
  ++work_.report.n_collapsed;
  return true;
}

bool Collapses::try_collapse(EdgeHandle edge, double cos_bound, CollapseFor aim) {
  if (work_.is_stopped()) return false;
  const auto planned = plan(edge, cos_bound, aim, patch_);
  return planned && carry_out(edge, *planned);
}

/// Largest sum of h_S theta_S over the sides of a triangle of `after`.
double Collapses::variation(const StarPatch& patch) const {
  std::vector<Vector3d> normals;
  for (const Corners& t : patch.after) normals.push_back(area_normal(t[0], t[1], t[2]));
  double largest = 0;
  for (std::size_t k = 0; k < patch.after.size(); ++k) {
    const Corners& t = patch.after[k];
    double sum = (t[2] - t[1]).norm() * angle_between(normals[k], normal_beyond_rim(patch, k));
    for (std::size_t other = 0; other < patch.after.size(); ++other) {
      const Corners& u = patch.after[other];
      if (u[1] == t[2]) sum += (t[2] - t[0]).norm() * angle_between(normals[k], normals[other]);
      if (u[2] == t[1]) sum += (t[1] - t[0]).norm() * angle_between(normals[k], normals[other]);
    }
    largest = std::max(largest, sum);
  }
  return largest;
}

/// Normal of the triangle across the rim's edge of a triangle that stays.
Vector3d Collapses::normal_beyond_rim(const StarPatch& patch, std::size_t k) const {
  for (const HalfedgeHandle h : mesh_.fh_range(patch.faces[k])) {
    if (work_.point(mesh_.from_vertex_handle(h)) != patch.kept[k][1] ||
        work_.point(mesh_.to_vertex_handle(h)) != patch.kept[k][2])
      continue;
    const HalfedgeHandle beyond = mesh_.opposite_halfedge_handle(h);
    const HalfedgeHandle next = mesh_.next_halfedge_handle(beyond);
    return area_normal(work_.point(mesh_.from_vertex_handle(beyond)),
                       work_.point(mesh_.to_vertex_handle(beyond)),
                       work_.point(mesh_.to_vertex_handle(next)));
  }
  return Vector3d::Zero();
}

void Collapses::collapse_short_edges(double cos_bound) {
  const auto is_short = [this](EdgeHandle edge) {
    return work_.length(edge) < options_.min_length;
  };
  plan_ahead(
      work_, by_rank(work_, work_.edges_that(is_short)),
      [this](EdgeHandle edge) { return work_.ends(edge); },
      [&](EdgeHandle edge) { return !work_.is_deleted(edge) && is_short(edge); },
      [&](EdgeHandle edge, StarPatch& patch) {
        return plan(edge, cos_bound, CollapseFor::kLength, patch);
      },
      [this](EdgeHandle edge, const StarPlan& planned) { carry_out(edge, planned); });
}

bool Collapses::is_star_flagged(const std::vector<char>& flags, VertexHandle vertex) const {
  for (const FaceHandle face : mesh_.vf_range(vertex))
    if (!flags[face.idx()]) return false;
  return true;
}

void Collapses::coarsen(double cos_bound) {
  assert(options_.may_coarsen.size() == mesh_.n_faces() && "one flag per face");
  std::vector<char> flags = options_.may_coarsen;
  const auto is_within = [&](EdgeHandle edge) {
    const auto [kept, removed] = work_.ends(edge);
    return is_star_flagged(flags, removed) && is_star_flagged(flags, kept);
  };
  plan_ahead(
      work_, by_rank(work_, work_.edges_that(is_within)),
      [this](EdgeHandle edge) { return work_.ends(edge); },
      [&](EdgeHandle edge) { return !work_.is_deleted(edge) && is_within(edge); },
      [&](EdgeHandle edge, StarPatch& patch) {
        return plan(edge, cos_bound, CollapseFor::kCoarseness, patch);
      },
      [&](EdgeHandle edge, const StarPlan& planned) {
        const VertexHandle kept = work_.ends(edge).first;
        if (!carry_out(edge, planned)) return;
        for (const FaceHandle face : mesh_.vf_range(kept)) flags[face.idx()] = 0;
      });
}

}  // namespace surf::mesh
