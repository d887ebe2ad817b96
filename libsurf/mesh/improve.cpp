#include "libsurf/mesh/improve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;
using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

using Corners = std::array<Vector3d, 3>;

constexpr double kCosTurn = 0.5;  // triangles turn by no more than 60 degrees

/// Closest point of a triangle: the plane's point if inside, else on the closest side.
double squared_distance(const Vector3d& point, const Corners& t) {
  const Vector3d normal = area_normal(t[0], t[1], t[2]);
  bool is_inside = normal.squaredNorm() > 0;
  double on_sides = std::numeric_limits<double>::max();
  for (int k = 0; k < 3; ++k) {
    const Vector3d side = t[(k + 1) % 3] - t[k], offset = point - t[k];
    if (normal.dot(side.cross(offset)) >= 0) continue;
    is_inside = false;
    const double at = std::clamp(offset.dot(side) / side.squaredNorm(), 0.0, 1.0);
    on_sides = std::min(on_sides, (offset - at * side).squaredNorm());
  }
  if (!is_inside) return on_sides;
  const double height = normal.dot(point - t[0]);
  return height * height / normal.squaredNorm();
}

struct Closest {
  double squared_distance = std::numeric_limits<double>::max();
  std::size_t triangle = 0;
};

Closest closest(const Vector3d& point, const std::vector<Corners>& patch) {
  Closest result;
  for (std::size_t k = 0; k < patch.size(); ++k) {
    const double squared = squared_distance(point, patch[k]);
    if (squared < result.squared_distance) result = {squared, k};
  }
  return result;
}

bool is_near(const Vector3d& point, const std::vector<Corners>& patch, double distance) {
  return std::any_of(patch.begin(), patch.end(), [&](const Corners& triangle) {
    return squared_distance(point, triangle) <= distance * distance;
  });
}

/// Whether the centre of a star and the midpoints of its spokes are near a patch.
bool is_star_near(const std::vector<Corners>& star, const std::vector<Corners>& patch,
                  double distance) {
  if (!is_near(star.front()[0], patch, distance)) return false;
  return std::all_of(star.begin(), star.end(), [&](const Corners& t) {
    return is_near(0.5 * (t[0] + t[1]), patch, distance);
  });
}

double sharpest(const std::vector<Corners>& patch) {
  double cosine = -1;
  for (const Corners& t : patch)
    cosine = std::max(cosine, angle_cosines(t[0], t[1], t[2]).sharpest);
  return cosine;
}

bool turns_too_far(const Vector3d& before, const Vector3d& now) {
  return !(before.dot(now) >= kCosTurn * std::sqrt(before.squaredNorm() * now.squaredNorm()));
}

/// One call of improve().
class Improvement {
 public:
  Improvement(TriMesh& mesh, const ImproveOptions& options)
      : mesh_(mesh),
        options_(options),
        witnesses_(mesh.n_faces()),
        is_reconnected_(mesh.n_faces(), false) {}

  ImproveReport run() {
    for (int sweep = 0; sweep < options_.n_sweeps; ++sweep) {
      const int n_before = n_changes();
      collapse_short_edges();
      if (sweep == 0 && !options_.may_coarsen.empty()) coarsen();
      flip_edges();
      mend_slivers();
      move_vertices();
      if (n_changes() == n_before) break;
    }
    finish();
    return report_;
  }

 private:
  /// Around the edge that is to be flipped: faces (a, b, c) and (b, a, d).
  struct Diamond {
    HalfedgeHandle halfedge, opposite;
    VertexHandle a, b, c, d;
  };

  /// The triangles of one or two stars before an operation, and those of the one star after it.
  struct Patch {
    std::vector<Corners> before;      // the centre of its star is the first corner
    std::vector<double> weight;       // of `before`: 1/2 for triangles that are in both stars
    std::vector<Corners> kept;        // those of `before` that stay
    std::vector<FaceHandle> faces;    // of `kept`
    std::vector<Corners> after;       // `kept` with the new place as first corner
    std::vector<Vector3d> witnesses;  // of all faces
  };

  int n_changes() const { return report_.n_collapsed + report_.n_flipped + report_.n_moved; }

  const Vector3d& point(VertexHandle vertex) const { return mesh_.point(vertex); }

  double length(EdgeHandle edge) const {
    const HalfedgeHandle h = mesh_.halfedge_handle(edge, 0);
    return (point(mesh_.to_vertex_handle(h)) - point(mesh_.from_vertex_handle(h))).norm();
  }

  /// For sorting: lengths that differ by rounding alone, as on symmetric surfaces, are ties.
  float rank(EdgeHandle edge) const { return static_cast<float>(length(edge)); }

  bool is_deleted(EdgeHandle edge) const { return mesh_.status(edge).deleted(); }
  bool is_deleted(FaceHandle face) const { return mesh_.status(face).deleted(); }

  bool is_frozen(FaceHandle face) const {
    return !options_.frozen.empty() && options_.frozen[face.idx()];
  }
  bool is_at_frozen(VertexHandle vertex) const {
    if (options_.frozen.empty()) return false;
    for (const FaceHandle face : mesh_.vf_range(vertex))
      if (is_frozen(face)) return true;
    return false;
  }

  // ---- flips ----

  Diamond diamond(EdgeHandle edge) const {
    const HalfedgeHandle h = mesh_.halfedge_handle(edge, 0), o = mesh_.halfedge_handle(edge, 1);
    return {h,
            o,
            mesh_.from_vertex_handle(h),
            mesh_.to_vertex_handle(h),
            mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)),
            mesh_.to_vertex_handle(mesh_.next_halfedge_handle(o))};
  }

  /// The angles at c and d sum to more than 190 degrees: by 10 not Delaunay, so that nearly
  /// cocircular points are left in peace.
  bool is_far_from_delaunay(EdgeHandle edge) const {
    constexpr double kSine = -0.17364817766693033;  // sin(190 degrees)
    const Diamond v = diamond(edge);
    const Vector3d ca = point(v.a) - point(v.c), cb = point(v.b) - point(v.c);
    const Vector3d da = point(v.a) - point(v.d), db = point(v.b) - point(v.d);
    const double cos_c = ca.dot(cb), cos_d = da.dot(db);
    if (cos_c >= 0 && cos_d >= 0) return false;  // neither angle is obtuse
    const double sin_c = ca.cross(cb).norm(), sin_d = da.cross(db).norm();
    const double scale =
        std::sqrt((cos_c * cos_c + sin_c * sin_c) * (cos_d * cos_d + sin_d * sin_d));
    return sin_c * cos_d + cos_c * sin_d < kSine * scale;
  }

  /// Distance between the diagonals ab and cd, which is that of the two pairs of triangles;
  /// empty if, seen along the common normal, they do not cross.
  std::optional<double> flip_distance(const Diamond& v) const {
    const Vector3d ab = point(v.b) - point(v.a), cd = point(v.d) - point(v.c);
    const Vector3d ac = point(v.c) - point(v.a);
    const Vector3d normal = ab.cross(cd);
    const double squared = normal.squaredNorm();
    const double on_ab = ac.cross(cd).dot(normal), on_cd = ac.cross(ab).dot(normal);
    const double margin = 1e-3 * squared;
    if (!(on_ab > margin && on_ab < squared - margin)) return std::nullopt;
    if (!(on_cd > margin && on_cd < squared - margin)) return std::nullopt;
    return std::abs(ac.dot(normal)) / std::sqrt(squared);
  }

  bool try_flip(EdgeHandle edge) {
    if (!mesh_.is_flip_ok(edge)) return false;
    const Diamond v = diamond(edge);
    if (mesh_.valence(v.a) <= 3 || mesh_.valence(v.b) <= 3) return false;
    if (is_frozen(mesh_.face_handle(v.halfedge)) || is_frozen(mesh_.face_handle(v.opposite)))
      return false;
    const Vector3d &a = point(v.a), &b = point(v.b), &c = point(v.c), &d = point(v.d);
    if ((d - c).norm() > std::max(options_.max_length, (b - a).norm())) return false;
    const double before =
        std::max(angle_cosines(a, b, c).sharpest, angle_cosines(b, a, d).sharpest);
    const double after = std::max(angle_cosines(c, d, b).sharpest, angle_cosines(d, c, a).sharpest);
    if (!(after < before)) return false;
    const Vector3d mean = area_normal(a, b, c) + area_normal(b, a, d);
    if (turns_too_far(mean, area_normal(c, d, b)) || turns_too_far(mean, area_normal(d, c, a)))
      return false;
    const std::optional<double> distance = flip_distance(v);
    if (!distance || *distance > options_.tolerance_mm) return false;
    const std::vector<FaceHandle> faces = {mesh_.face_handle(v.halfedge),
                                           mesh_.face_handle(v.opposite)};
    const std::vector<Corners> patch = {{c, d, b}, {d, c, a}};
    std::vector<Vector3d> witnesses;
    for (const FaceHandle face : faces) add_witnesses(face, witnesses);
    if (!are_witnesses_near(witnesses, patch)) return false;
    mesh_.flip(edge);
    for (const FaceHandle face : faces) is_reconnected_[face.idx()] = true;
    // OpenMesh's flip leaves the side of b with the first half-edge's face or the other: ask.
    const bool is_first = has_corner(faces[0], v.b);
    hand_over(witnesses, patch, is_first ? faces : std::vector{faces[1], faces[0]});
    ++report_.n_flipped;
    return true;
  }

  bool has_corner(FaceHandle face, VertexHandle vertex) const {
    const HalfedgeHandle h = mesh_.halfedge_handle(face);
    return mesh_.from_vertex_handle(h) == vertex || mesh_.to_vertex_handle(h) == vertex ||
           mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)) == vertex;
  }

  /// Flips until no edge asks for it; each edge's turn comes again when its triangles change.
  void flip_edges() {
    std::vector<EdgeHandle> queue;
    for (const auto edge : mesh_.edges())
      if (!is_deleted(edge) && is_far_from_delaunay(edge)) queue.push_back(edge);
    // A flip raises the smallest angle of its two triangles, so none comes back; the
    // limit is for rounding.
    std::size_t n_left = 10 * queue.size();
    for (std::size_t at = 0; at < queue.size() && n_left > 0; ++at, --n_left) {
      if (!is_far_from_delaunay(queue[at]) || !try_flip(queue[at])) continue;
      const Diamond v = diamond(queue[at]);
      for (const HalfedgeHandle h : {v.halfedge, v.opposite}) {
        const HalfedgeHandle next = mesh_.next_halfedge_handle(h);
        queue.push_back(mesh_.edge_handle(next));
        queue.push_back(mesh_.edge_handle(mesh_.next_halfedge_handle(next)));
      }
    }
  }

  // ---- patches: what collapses and moves have in common ----

  // Witnesses are the vertices and midpoints of edges of the surface at the start. Each is kept by
  // a face close to it; faces that no operation has touched keep their own without a list.

  void add_witnesses(FaceHandle face, std::vector<Vector3d>& witnesses) const {
    const auto& list = witnesses_[face.idx()];
    if (list.has_value()) {
      witnesses.insert(witnesses.end(), list->begin(), list->end());
      return;
    }
    for (const HalfedgeHandle h : mesh_.fh_range(face)) {
      const Vector3d &from = point(mesh_.from_vertex_handle(h)),
                     &to = point(mesh_.to_vertex_handle(h));
      witnesses.push_back(from);
      witnesses.push_back(0.5 * (from + to));
    }
  }

  bool are_witnesses_near(const std::vector<Vector3d>& witnesses,
                          const std::vector<Corners>& patch) const {
    return std::all_of(witnesses.begin(), witnesses.end(), [&](const Vector3d& witness) {
      return is_near(witness, patch, options_.tolerance_mm);
    });
  }

  /// Each witness goes to the closest triangle of the patch. @pre faces[k] is patch[k]
  void hand_over(const std::vector<Vector3d>& witnesses, const std::vector<Corners>& patch,
                 const std::vector<FaceHandle>& faces) {
    for (const FaceHandle face : faces) witnesses_[face.idx()].emplace();
    for (const Vector3d& witness : witnesses)
      witnesses_[faces[closest(witness, patch).triangle].idx()]->push_back(witness);
  }

  void add_star(VertexHandle vertex, VertexHandle other, bool is_second) {
    for (const HalfedgeHandle spoke : mesh_.voh_range(vertex)) {
      const HalfedgeHandle rim = mesh_.next_halfedge_handle(spoke);
      const VertexHandle from = mesh_.to_vertex_handle(spoke), to = mesh_.to_vertex_handle(rim);
      const FaceHandle face = mesh_.face_handle(spoke);
      const bool is_shared = from == other || to == other;
      if (!is_shared || !is_second) add_witnesses(face, patch_.witnesses);
      patch_.before.push_back({point(vertex), point(from), point(to)});
      patch_.weight.push_back(is_shared ? 0.5 : 1.0);
      if (is_shared) continue;
      patch_.kept.push_back(patch_.before.back());
      patch_.faces.push_back(face);
    }
  }

  void collect_patch(VertexHandle vertex, VertexHandle other = VertexHandle()) {
    patch_.before.clear();
    patch_.weight.clear();
    patch_.kept.clear();
    patch_.faces.clear();
    patch_.witnesses.clear();
    add_star(vertex, other, /*is_second=*/false);
    if (other.is_valid()) add_star(other, vertex, /*is_second=*/true);
  }

  void set_place(const Vector3d& place) {
    patch_.after = patch_.kept;
    for (Corners& triangle : patch_.after) triangle[0] = place;
  }

  /// Sum of a x b over the rim: 6 times the gradient of the volume.
  Vector3d rim_normal(const Vector3d& origin) const {
    Vector3d normal = Vector3d::Zero();
    for (const Corners& t : patch_.kept) normal += (t[1] - origin).cross(t[2] - origin);
    return normal;
  }

  /// A triangle too thin to have a normal of its own is compared with its patch.
  bool has_turned() const {
    constexpr double kCosThin = 0.9962;  // 5 degrees
    const Vector3d mean = rim_normal(patch_.after.front()[0]);
    for (std::size_t k = 0; k < patch_.kept.size(); ++k) {
      const Corners &old = patch_.kept[k], &now = patch_.after[k];
      const bool is_thin = angle_cosines(old[0], old[1], old[2]).sharpest > kCosThin;
      const Vector3d reference = is_thin ? mean : area_normal(old[0], old[1], old[2]);
      if (turns_too_far(reference, area_normal(now[0], now[1], now[2]))) return true;
    }
    return false;
  }

  static double longest_spoke(const std::vector<Corners>& star) {
    double longest = 0;
    for (const Corners& t : star) longest = std::max(longest, (t[1] - t[0]).norm());
    return longest;
  }

  bool is_patch_near() const {
    return is_star_near(patch_.after, patch_.before, options_.tolerance_mm) &&
           are_witnesses_near(patch_.witnesses, patch_.after);
  }

  /// The place with the largest smallest angle among those allowed, if its cosine is below the
  /// bound and no spoke gets longer than max_spoke.
  std::optional<Vector3d> best_place(const std::vector<Vector3d>& places, double cos_bound,
                                     double max_spoke) {
    std::vector<std::pair<double, std::size_t>> by_angle;  // the checks of distance are dear
    for (std::size_t k = 0; k < places.size(); ++k) {
      set_place(places[k]);
      const double cosine = sharpest(patch_.after);
      if (cosine < cos_bound) by_angle.emplace_back(cosine, k);
    }
    std::sort(by_angle.begin(), by_angle.end());
    for (const auto& [unused, k] : by_angle) {
      set_place(places[k]);
      if (longest_spoke(patch_.after) > max_spoke) continue;
      if (!has_turned() && is_patch_near()) return places[k];
    }
    return std::nullopt;
  }

  void apply(VertexHandle vertex, const Vector3d& place) {
    mesh_.set_point(vertex, place);
    set_place(place);
    hand_over(patch_.witnesses, patch_.after, patch_.faces);
  }

  // ---- the border of a box ----

  /// Whether a vertex has faces on the box's border and others.
  bool ends_on_border(VertexHandle vertex) const {
    if (options_.box->faces(point(vertex)) == 0) return false;
    bool is_on = false, is_off = false;
    for (const FaceHandle face : mesh_.vf_range(vertex)) {
      std::uint8_t common = 0xff;
      for (const VertexHandle corner : mesh_.fv_range(face))
        common &= options_.box->faces(point(corner));
      (common != 0 ? is_on : is_off) = true;
    }
    return is_on && is_off;
  }

  /// Places for what stands for both vertices.
  void keep_on_border(VertexHandle a, VertexHandle b, std::vector<Vector3d>& places) const {
    if (!options_.box) return;
    const bool a_ends = ends_on_border(a), b_ends = ends_on_border(b);
    if (a_ends != b_ends) places = {point(a_ends ? a : b)};
    const std::uint8_t faces = options_.box->faces(point(a)) | options_.box->faces(point(b));
    for (Vector3d& place : places) place = options_.box->clamped(place, faces);
  }

  // ---- collapses ----

  /// Puts places where the volume is that of the two stars: along the rim's normal.
  void keep_volume(std::vector<Vector3d>& places) const {
    for (Vector3d& place : places) {
      double volume = 0;  // 6 times that of the stars' cones from the place
      for (std::size_t k = 0; k < patch_.before.size(); ++k)
        volume += patch_.weight[k] * cone(place, patch_.before[k]);
      const Vector3d normal = rim_normal(place);
      if (normal.squaredNorm() > 0) place += volume / normal.squaredNorm() * normal;
    }
  }

  static double cone(const Vector3d& apex, const Corners& t) {
    return (t[0] - apex).dot((t[1] - apex).cross(t[2] - apex));
  }

  bool is_collapse_safe(HalfedgeHandle halfedge) {
    if (!mesh_.is_collapse_ok(halfedge)) return false;
    if (is_at_frozen(mesh_.from_vertex_handle(halfedge)) ||
        is_at_frozen(mesh_.to_vertex_handle(halfedge)))
      return false;
    const Diamond v = diamond(mesh_.edge_handle(halfedge));
    return mesh_.valence(v.c) > 3 && mesh_.valence(v.d) > 3 &&
           mesh_.valence(v.a) + mesh_.valence(v.b) >= 7;
  }

  /// What a collapse is for: to remove a short edge, a sharp angle, or what is finer than it need
  /// be.
  enum class CollapseFor { kLength, kAngle, kCoarseness };

  /// Collapses the edge if the smallest angle of what is left has a cosine below the bound.
  bool try_collapse(EdgeHandle edge, double cos_bound, CollapseFor aim) {
    const HalfedgeHandle halfedge = mesh_.halfedge_handle(edge, 0);
    if (!is_collapse_safe(halfedge)) return false;
    const VertexHandle removed = mesh_.from_vertex_handle(halfedge);
    const VertexHandle kept = mesh_.to_vertex_handle(halfedge);
    collect_patch(kept, removed);
    const Vector3d &from = point(removed), &to = point(kept);
    std::vector<Vector3d> places = {0.5 * (from + to), from, to};
    keep_volume(places);
    keep_on_border(removed, kept, places);
    const double before = sharpest(patch_.before);
    const double bound = aim == CollapseFor::kAngle    ? before
                         : aim == CollapseFor::kLength ? std::max(before, cos_bound)
                                                       : cos_bound;
    const auto best = best_place(places, bound, options_.max_length);
    if (!best) return false;
    if (aim == CollapseFor::kCoarseness) {
      set_place(*best);
      if (patch_variation() > options_.max_variation_mm) return false;
    }
    mesh_.collapse(halfedge);
    for (const FaceHandle face : patch_.faces) is_reconnected_[face.idx()] = true;
    apply(kept, *best);
    ++report_.n_collapsed;
    return true;
  }

  /// Largest sum of h_S theta_S over the sides of a triangle of `after`.
  double patch_variation() const {
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
  Vector3d normal_beyond_rim(std::size_t k) const {
    for (const HalfedgeHandle h : mesh_.fh_range(patch_.faces[k])) {
      if (point(mesh_.from_vertex_handle(h)) != patch_.kept[k][1] ||
          point(mesh_.to_vertex_handle(h)) != patch_.kept[k][2])
        continue;
      const HalfedgeHandle beyond = mesh_.opposite_halfedge_handle(h);
      const HalfedgeHandle next = mesh_.next_halfedge_handle(beyond);
      return area_normal(point(mesh_.from_vertex_handle(beyond)),
                         point(mesh_.to_vertex_handle(beyond)),
                         point(mesh_.to_vertex_handle(next)));
    }
    return Vector3d::Zero();
  }

  void collapse_short_edges() {
    std::vector<std::pair<float, int>> edges;
    for (const auto edge : mesh_.edges())
      if (!is_deleted(edge) && length(edge) < options_.min_length)
        edges.emplace_back(rank(edge), edge.idx());
    std::sort(edges.begin(), edges.end());
    for (const auto& [unused, index] : edges) {
      const EdgeHandle edge(index);
      if (!is_deleted(edge) && length(edge) < options_.min_length)
        try_collapse(edge, cos_bound_, CollapseFor::kLength);
    }
  }

  // ---- coarsening ----

  bool is_star_flagged(const std::vector<char>& flags, VertexHandle vertex) const {
    for (const FaceHandle face : mesh_.vf_range(vertex))
      if (!flags[face.idx()]) return false;
    return true;
  }

  void coarsen() {
    assert(options_.may_coarsen.size() == witnesses_.size() && "one flag per face");
    std::vector<char> flags = options_.may_coarsen;
    std::vector<std::pair<float, int>> edges;
    for (const auto edge : mesh_.edges())
      if (!is_deleted(edge)) edges.emplace_back(rank(edge), edge.idx());
    std::sort(edges.begin(), edges.end());
    for (const auto& [unused, index] : edges) {
      const EdgeHandle edge(index);
      if (is_deleted(edge)) continue;
      const HalfedgeHandle h = mesh_.halfedge_handle(edge, 0);
      const VertexHandle kept = mesh_.to_vertex_handle(h);
      if (!is_star_flagged(flags, mesh_.from_vertex_handle(h)) || !is_star_flagged(flags, kept) ||
          !try_collapse(edge, cos_coarsen_, CollapseFor::kCoarseness))
        continue;
      for (const FaceHandle face : mesh_.vf_range(kept)) flags[face.idx()] = 0;
    }
  }

  // ---- slivers ----

  /// Faces with a smaller angle than the bound, the worst first.
  std::vector<FaceHandle> poor_faces(double cos_bound) const {
    std::vector<std::pair<float, int>> found;
    for (const auto face : mesh_.faces()) {
      if (is_deleted(face)) continue;
      const double cosine = angle_cosines(mesh_, face).sharpest;
      if (cosine > cos_bound) found.emplace_back(static_cast<float>(-cosine), face.idx());
    }
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
      return std::pair(rank(left), left.idx()) < std::pair(rank(right), right.idx());
    });
    return edges;
  }

  void mend_slivers() {
    for (const FaceHandle face : poor_faces(cos_bound_)) {
      if (is_deleted(face) || angle_cosines(mesh_, face).sharpest <= cos_bound_) continue;
      const auto edges = edges_by_length(face);
      if (try_flip(edges[2])) continue;
      for (const EdgeHandle edge : edges)
        if (try_collapse(edge, cos_bound_, CollapseFor::kAngle)) break;
    }
  }

  // ---- moves ----

  /// Towards the centroid of the star by area and towards the mean of the neighbours, all of the
  /// way and in part, in the plane through the vertex that keeps the volume.
  std::vector<Vector3d> places_in_plane(const Vector3d& z) const {
    Vector3d by_area = Vector3d::Zero(), mean = Vector3d::Zero();
    double area = 0;
    for (const Corners& t : patch_.before) {
      const double weight = area_normal(t[0], t[1], t[2]).norm();
      by_area += weight * (t[1] + t[2] - 2 * z) / 3;
      mean += t[1] - z;
      area += weight;
    }
    const Vector3d normal = rim_normal(z);
    std::vector<Vector3d> places;
    if (!(area > 0) || !(normal.norm() > 0.01 * area)) return places;
    by_area /= area;
    mean /= static_cast<double>(patch_.before.size());
    for (const Vector3d& shift : {by_area, mean})
      for (const double part : {1.0, 0.5, 0.2})
        places.push_back(z + part * (shift - normal.dot(shift) / normal.squaredNorm() * normal));
    return places;
  }

  void try_move(VertexHandle vertex) {
    if (options_.box && ends_on_border(vertex)) return;
    collect_patch(vertex);
    // By 1 % of the angle at least, so that sweeps end.
    const double angle = std::acos(std::min(1.0, sharpest(patch_.before)));
    std::vector<Vector3d> places = places_in_plane(point(vertex));
    keep_on_border(vertex, vertex, places);
    const auto best = best_place(places, std::cos(1.01 * angle),
                                 std::max(options_.max_length, longest_spoke(patch_.before)));
    if (!best) return;
    apply(vertex, *best);
    ++report_.n_moved;
  }

  void move_vertices() {
    std::vector<int> vertices;
    for (const FaceHandle face : poor_faces(cos_move_))
      for (const VertexHandle vertex : mesh_.fv_range(face)) vertices.push_back(vertex.idx());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    for (const int vertex : vertices)
      if (!is_at_frozen(VertexHandle(vertex))) try_move(VertexHandle(vertex));
  }

  // ---- end ----

  /// Each vertex whose star has changed is in one of these faces: flips and collapses leave the
  /// vertices of all faces they change in faces they have changed.
  void mark_reconnected_faces() {
    if (!has_refinement_edges(mesh_)) return;
    std::vector<FaceHandle> faces;
    for (int j = 0; j < static_cast<int>(is_reconnected_.size()); ++j)
      if (is_reconnected_[j] && !is_deleted(FaceHandle(j))) faces.emplace_back(j);
    mark_longest_edges(mesh_, faces);
  }

  void finish() {
    mark_reconnected_faces();
    if (report_.n_collapsed > 0) collect_garbage(mesh_);
    double cosine = -1;
    for (int j = 0; j < static_cast<int>(mesh_.n_faces()); ++j) {
      const double sharp = angle_cosines(mesh_, FaceHandle(j)).sharpest;
      if (sharp > cos_bound_) ++report_.n_poor;
      cosine = std::max(cosine, sharp);
    }
    report_.min_angle_deg = std::acos(std::min(1.0, cosine)) * 180 / std::numbers::pi;
  }

  TriMesh& mesh_;
  const ImproveOptions& options_;
  const double cos_bound_ = cos_deg(options_.min_angle_deg);
  const double cos_move_ = cos_deg(options_.min_angle_deg + 10);
  const double cos_coarsen_ = cos_deg(options_.min_angle_deg + 5);
  std::vector<std::optional<std::vector<Vector3d>>> witnesses_;  // of each face that was touched
  std::vector<bool> is_reconnected_;  // faces that a flip or a collapse has changed
  Patch patch_;
  ImproveReport report_;
};

}  // namespace

std::string ImproveOptions::error() const {
  const auto message = [](const char* field, double value, const char* constraint) {
    return fmt::format("ImproveOptions::{} = {} violates {}", field, value, constraint);
  };
  if (!(min_length >= 0)) return message("min_length", min_length, ">= 0");
  if (!(max_length > 2 * min_length)) return message("max_length", max_length, "> 2 * min_length");
  if (!(tolerance_mm > 0)) return message("tolerance_mm", tolerance_mm, "> 0");
  if (!(min_angle_deg > 0 && min_angle_deg < 50))
    return message("min_angle_deg", min_angle_deg, "in (0, 50)");
  if (!(n_sweeps >= 0)) return message("n_sweeps", n_sweeps, ">= 0");
  return "";
}

ImproveReport improve(TriMesh& mesh, const ImproveOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw std::invalid_argument(error);
  return Improvement(mesh, options).run();
}

}  // namespace surf::mesh
