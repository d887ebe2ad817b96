#include "libsurf/mesh/detail/collapses.h"

#include <algorithm>
#include <cassert>
#include <optional>
#include <utility>

#include "libsurf/base/products.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

double cone(const Vector3d& apex, const Corners& t) {
  return triple(t[0] - apex, t[1] - apex, t[2] - apex);
}

}  // namespace

/// Puts places where the volume is that of the two stars: along the rim's normal.
void Collapses::keep_volume(std::vector<Vector3d>& places) const {
  for (Vector3d& place : places) {
    double volume = 0;  // 6 times that of the stars' cones from the place
    for (std::size_t k = 0; k < patch_.before.size(); ++k)
      volume += patch_.weight[k] * cone(place, patch_.before[k]);
    const Vector3d normal = patch_.rim_normal(place);
    if (normal.squaredNorm() > 0) place += volume / normal.squaredNorm() * normal;
  }
}

bool Collapses::is_collapse_safe(HalfedgeHandle halfedge) {
  if (!mesh_.is_collapse_ok(halfedge)) return false;
  if (work_.is_at_frozen(mesh_.from_vertex_handle(halfedge)) ||
      work_.is_at_frozen(mesh_.to_vertex_handle(halfedge)))
    return false;
  const Diamond v = work_.diamond(mesh_.edge_handle(halfedge));
  return mesh_.valence(v.c) > 3 && mesh_.valence(v.d) > 3 &&
         mesh_.valence(v.a) + mesh_.valence(v.b) >= 7;
}

bool Collapses::try_collapse(EdgeHandle edge, double cos_bound, CollapseFor aim) {
  const HalfedgeHandle halfedge = mesh_.halfedge_handle(edge, 0);
  if (work_.is_stopped() || !is_collapse_safe(halfedge)) return false;
  const VertexHandle removed = mesh_.from_vertex_handle(halfedge);
  const VertexHandle kept = mesh_.to_vertex_handle(halfedge);
  patch_.collect(kept, removed);
  const Vector3d &from = work_.point(removed), &to = work_.point(kept);
  std::vector<Vector3d> places = {0.5 * (from + to), from, to};
  keep_volume(places);
  work_.keep_on_border(removed, kept, places);
  const double before = sharpest(patch_.before);
  const double bound = aim == CollapseFor::kAngle    ? before
                       : aim == CollapseFor::kLength ? std::max(before, cos_bound)
                                                     : cos_bound;
  const auto best = patch_.best_place(places, bound, options_.max_length);
  if (!best) return false;
  if (aim == CollapseFor::kCoarseness) {
    patch_.set_place(*best);
    if (patch_variation() > options_.max_variation_mm) return false;
  }
  mesh_.collapse(halfedge);
  for (const FaceHandle face : patch_.faces) work_.is_reconnected[face.idx()] = true;
  patch_.apply(kept, *best);
  ++work_.report.n_collapsed;
  return true;
}

/// Largest sum of h_S theta_S over the sides of a triangle of `after`.
double Collapses::patch_variation() const {
  std::vector<Vector3d> normals;
  for (const Corners& t : patch_.after) normals.push_back(area_normal(t[0], t[1], t[2]));
  double largest = 0;
  for (std::size_t k = 0; k < patch_.after.size(); ++k) {
    const Corners& t = patch_.after[k];
    double sum = (t[2] - t[1]).norm() * angle_between(normals[k], normal_beyond_rim(k));
    for (std::size_t other = 0; other < patch_.after.size(); ++other) {
      const Corners& u = patch_.after[other];
      if (u[1] == t[2]) sum += (t[2] - t[0]).norm() * angle_between(normals[k], normals[other]);
      if (u[2] == t[1]) sum += (t[1] - t[0]).norm() * angle_between(normals[k], normals[other]);
    }
    largest = std::max(largest, sum);
  }
  return largest;
}

/// Normal of the triangle across the rim's edge of a triangle that stays.
Vector3d Collapses::normal_beyond_rim(std::size_t k) const {
  for (const HalfedgeHandle h : mesh_.fh_range(patch_.faces[k])) {
    if (work_.point(mesh_.from_vertex_handle(h)) != patch_.kept[k][1] ||
        work_.point(mesh_.to_vertex_handle(h)) != patch_.kept[k][2])
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
  std::vector<std::pair<float, int>> edges;
  for (const auto edge : mesh_.edges())
    if (work_.may_change(edge) && work_.length(edge) < options_.min_length)
      edges.emplace_back(work_.rank(edge), edge.idx());
  std::sort(edges.begin(), edges.end());
  for (const auto& [unused, index] : edges) {
    const EdgeHandle edge(index);
    if (!work_.is_deleted(edge) && work_.length(edge) < options_.min_length)
      try_collapse(edge, cos_bound, CollapseFor::kLength);
  }
}

bool Collapses::is_star_flagged(const std::vector<char>& flags, VertexHandle vertex) const {
  for (const FaceHandle face : mesh_.vf_range(vertex))
    if (!flags[face.idx()]) return false;
  return true;
}

void Collapses::coarsen(double cos_bound) {
  assert(options_.may_coarsen.size() == mesh_.n_faces() && "one flag per face");
  std::vector<char> flags = options_.may_coarsen;
  std::vector<std::pair<float, int>> edges;
  for (const auto edge : mesh_.edges())
    if (work_.may_change(edge)) edges.emplace_back(work_.rank(edge), edge.idx());
  std::sort(edges.begin(), edges.end());
  for (const auto& [unused, index] : edges) {
    const EdgeHandle edge(index);
    if (work_.is_deleted(edge)) continue;
    const HalfedgeHandle h = mesh_.halfedge_handle(edge, 0);
    const VertexHandle kept = mesh_.to_vertex_handle(h);
    if (!is_star_flagged(flags, mesh_.from_vertex_handle(h)) || !is_star_flagged(flags, kept) ||
        !try_collapse(edge, cos_bound, CollapseFor::kCoarseness))
      continue;
    for (const FaceHandle face : mesh_.vf_range(kept)) flags[face.idx()] = 0;
  }
}

}  // namespace surf::mesh
