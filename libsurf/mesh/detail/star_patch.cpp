#include "libsurf/mesh/detail/star_patch.h"

#include <algorithm>
#include <utility>

namespace surf::mesh {

using Eigen::Vector3d;

void StarPatch::add_star(VertexHandle vertex, VertexHandle other, bool is_second) {
  for (const HalfedgeHandle spoke : mesh_.voh_range(vertex)) {
    const HalfedgeHandle rim = mesh_.next_halfedge_handle(spoke);
    const VertexHandle from = mesh_.to_vertex_handle(spoke), to = mesh_.to_vertex_handle(rim);
    const FaceHandle face = mesh_.face_handle(spoke);
    const bool is_shared = from == other || to == other;
    if (!is_shared || !is_second) work_.add_witnesses(face, witnesses);
    before.push_back({work_.point(vertex), work_.point(from), work_.point(to)});
    weight.push_back(is_shared ? 0.5 : 1.0);
    if (is_shared) continue;
    kept.push_back(before.back());
    faces.push_back(face);
  }
}

void StarPatch::collect(VertexHandle vertex, VertexHandle other) {
  before.clear();
  weight.clear();
  kept.clear();
  faces.clear();
  witnesses.clear();
  add_star(vertex, other, /*is_second=*/false);
  if (other.is_valid()) add_star(other, vertex, /*is_second=*/true);
}

void StarPatch::set_place(const Vector3d& place) {
  after = kept;
  for (Corners& triangle : after) triangle[0] = place;
}

Vector3d StarPatch::rim_normal(const Vector3d& origin) const {
  Vector3d normal = Vector3d::Zero();
  for (const Corners& t : kept) normal += (t[1] - origin).cross(t[2] - origin);
  return normal;
}

/// A triangle too thin to have a normal of its own is compared with its patch.
bool StarPatch::has_turned() const {
  constexpr double kCosThin = 0.9962;  // 5 degrees
  const Vector3d mean = rim_normal(after.front()[0]);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const Corners &old = kept[k], &now = after[k];
    const bool is_thin = angle_cosines(old[0], old[1], old[2]).sharpest > kCosThin;
    const Vector3d reference = is_thin ? mean : area_normal(old[0], old[1], old[2]);
    if (turns_too_far(reference, area_normal(now[0], now[1], now[2]))) return true;
  }
  return false;
}

bool StarPatch::is_near_the_old() const {
  return is_star_near(after, NearPatch(before), options_.tolerance_mm) &&
         work_.are_witnesses_near(witnesses, after);
}

std::optional<Vector3d> StarPatch::best_place(const std::vector<Vector3d>& places, double cos_bound,
                                              double max_spoke) {
  std::vector<std::pair<double, std::size_t>> by_angle;  // the checks of distance are dear
  for (std::size_t k = 0; k < places.size(); ++k) {
    set_place(places[k]);
    const double cosine = sharpest(after);
    if (cosine < cos_bound) by_angle.emplace_back(cosine, k);
  }
  std::sort(by_angle.begin(), by_angle.end());
  for (const auto& [unused, k] : by_angle) {
    set_place(places[k]);
    if (longest_spoke(after) > max_spoke) continue;
    if (!has_turned() && is_near_the_old()) return places[k];
  }
  return std::nullopt;
}

StarPlan StarPatch::plan(const Vector3d& place) {
  set_place(place);
  return {place, faces, witnesses, closest_of(after, witnesses)};
}

void apply(const StarPlan& plan, VertexHandle vertex, Mending& work) {
  work.mesh.set_point(vertex, plan.place);
  work.hand_over(plan.witnesses, plan.keepers, plan.faces);
  work.note_change_at(vertex);
}

}  // namespace surf::mesh
