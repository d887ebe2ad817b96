#include "libsurf/mesh/detail/flips.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "libsurf/mesh/detail/plan_ahead.h"

namespace surf::mesh {

using Eigen::Vector3d;

/// The angles at c and d sum to more than 190 degrees: by 10 not Delaunay, so that nearly
/// cocircular points are left in peace.
bool Flips::is_far_from_delaunay(EdgeHandle edge) const {
  constexpr double kSine = -0.17364817766693033;  // sin(190 degrees)
  const Diamond v = work_.diamond(edge);
  const Vector3d ca = work_.point(v.a) - work_.point(v.c), cb = work_.point(v.b) - work_.point(v.c);
  const Vector3d da = work_.point(v.a) - work_.point(v.d), db = work_.point(v.b) - work_.point(v.d);
  const double cos_c = ca.dot(cb), cos_d = da.dot(db);
  if (cos_c >= 0 && cos_d >= 0) return false;  // neither angle is obtuse
  const double sin_c = ca.cross(cb).norm(), sin_d = da.cross(db).norm();
  const double scale = std::sqrt((cos_c * cos_c + sin_c * sin_c) * (cos_d * cos_d + sin_d * sin_d));
  return sin_c * cos_d + cos_c * sin_d < kSine * scale;
}

/// Distance between the diagonals ab and cd, which is that of the two pairs of triangles;
/// empty if, seen along the common normal, they do not cross.
std::optional<double> Flips::flip_distance(const Diamond& v) const {
  const Vector3d ab = work_.point(v.b) - work_.point(v.a), cd = work_.point(v.d) - work_.point(v.c);
  const Vector3d ac = work_.point(v.c) - work_.point(v.a);
  const Vector3d normal = ab.cross(cd);
  const double squared = normal.squaredNorm();
  const double on_ab = ac.cross(cd).dot(normal), on_cd = ac.cross(ab).dot(normal);
  const double margin = 1e-3 * squared;
  if (!(on_ab > margin && on_ab < squared - margin)) return std::nullopt;
  if (!(on_cd > margin && on_cd < squared - margin)) return std::nullopt;
  return std::abs(ac.dot(normal)) / std::sqrt(squared);
}

std::optional<Flips::FlipPlan> Flips::plan(EdgeHandle edge) const {
  if (!mesh_.is_flip_ok(edge)) return std::nullopt;
  const Diamond v = work_.diamond(edge);
  if (mesh_.valence(v.a) <= 3 || mesh_.valence(v.b) <= 3 || !work_.may_change(edge))
    return std::nullopt;
  const Vector3d &a = work_.point(v.a), &b = work_.point(v.b), &c = work_.point(v.c),
                 &d = work_.point(v.d);
  if ((d - c).norm() > std::max(options_.max_length, (b - a).norm())) return std::nullopt;
  const double before = std::max(angle_cosines(a, b, c).sharpest, angle_cosines(b, a, d).sharpest);
  const double after = std::max(angle_cosines(c, d, b).sharpest, angle_cosines(d, c, a).sharpest);
  if (!(after < before)) return std::nullopt;
  if (options_.box) {  // else it would cut off an edge of the box
    const std::uint8_t of_edge = options_.box->faces(a) & options_.box->faces(b),
                       with_c = of_edge & options_.box->faces(c),
                       with_d = of_edge & options_.box->faces(d);
    if (with_c != 0 && with_d != 0 && with_c != with_d) return std::nullopt;
  }
  const Vector3d mean = area_normal(a, b, c) + area_normal(b, a, d);
  if (turns_too_far(mean, area_normal(c, d, b)) || turns_too_far(mean, area_normal(d, c, a)))
    return std::nullopt;
  const std::optional<double> distance = flip_distance(v);
  if (!distance || *distance > options_.tolerance_mm) return std::nullopt;
  const std::vector<Corners> patch = {{c, d, b}, {d, c, a}};
  FlipPlan planned;
  for (const HalfedgeHandle h : {v.halfedge, v.opposite})
    work_.add_witnesses(mesh_.face_handle(h), planned.witnesses);
  if (!work_.are_witnesses_near(planned.witnesses, patch)) return std::nullopt;
  planned.keepers = closest_of(patch, planned.witnesses);
  return planned;
}

void Flips::carry_out(EdgeHandle edge, const FlipPlan& plan) {
  const Diamond v = work_.diamond(edge);
  const std::vector<FaceHandle> faces = {mesh_.face_handle(v.halfedge),
                                         mesh_.face_handle(v.opposite)};
  mesh_.flip(edge);
  for (const FaceHandle face : faces) work_.is_reconnected[face.idx()] = true;
  // OpenMesh's flip leaves the side of b with the first half-edge's face or the other: ask.
  const bool is_first = has_corner(faces[0], v.b);
  work_.hand_over(plan.witnesses, plan.keepers, is_first ? faces : std::vector{faces[1], faces[0]});
  work_.note_change_at(v.c);  // with the other three, which are its neighbours now
  ++work_.report.n_flipped;
}

bool Flips::try_flip(EdgeHandle edge) {
  if (work_.is_stopped()) return false;
  const auto planned = plan(edge);
  if (planned) carry_out(edge, *planned);
  return planned.has_value();
}

bool Flips::has_corner(FaceHandle face, VertexHandle vertex) const {
  const HalfedgeHandle h = mesh_.halfedge_handle(face);
  return mesh_.from_vertex_handle(h) == vertex || mesh_.to_vertex_handle(h) == vertex ||
         mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)) == vertex;
}

void Flips::flip_edges() {
  std::vector<EdgeHandle> edges =
      work_.edges_that([this](EdgeHandle edge) { return is_far_from_delaunay(edge); });
  // A flip raises the smallest angle of its two triangles, so none comes back; the
  // limit is for rounding.
  std::size_t n_left = 10 * edges.size();
  while (!edges.empty()) {
    edges.resize(std::min(edges.size(), n_left));
    n_left -= edges.size();
    std::vector<EdgeHandle> next;  // whose triangles have changed
    plan_ahead(
        work_, edges, [this](EdgeHandle edge) { return work_.ends(edge); },
        [this](EdgeHandle edge) { return is_far_from_delaunay(edge); },
        [this](EdgeHandle edge, StarPatch&) { return plan(edge); },
        [&](EdgeHandle edge, const FlipPlan& planned) {
          carry_out(edge, planned);
          const Diamond v = work_.diamond(edge);
          for (const HalfedgeHandle h : {v.halfedge, v.opposite}) {
            const HalfedgeHandle after = mesh_.next_halfedge_handle(h);
            next.push_back(mesh_.edge_handle(after));
            next.push_back(mesh_.edge_handle(mesh_.next_halfedge_handle(after)));
          }
        });
    edges = std::move(next);
  }
}

}  // namespace surf::mesh
