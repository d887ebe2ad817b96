#include "libsurf/mesh/moving_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/mesh/adaptivity.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/clip.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/improve.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/sheet_guard.h"
#include "libsurf/mesh/surgery.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

constexpr int kGuardRounds = 3;
constexpr int kRoundsAtTheStart = 30, kRoundsInAStep = 2;  // of adaptivity
// Of the faces, by a round that is the last one. With 0.99 the inside of a skull takes 6 steps, not
// 4, and evolves for 3.1 s, not 2.3; the mean error of twelve phantoms is 0.0274 voxel, not 0.0273.
constexpr double kShareLeftAtTheStart = 0.93;
constexpr double kContact = 0.9;  // of sheets, of the resolution: one node fits between them
constexpr double kContested = 2;  // resolutions: nearer to a contested point sheets stay apart
constexpr int kMendingRounds = 4;
constexpr double kFrozenRadius = 0.5;  // of the wanted edge length, in the second round

Vector<3> centroid(const Points<3>& X, const Elements<3>& T, int triangle) {
  return (X.row(T(triangle, 0)) + X.row(T(triangle, 1)) + X.row(T(triangle, 2))).transpose() / 3;
}

/// Flags of the faces with a corner or their centroid within `radius` of one of the places.
std::vector<char> faces_near(const TriMesh& mesh, const std::vector<Vector<3>>& places,
                             double radius) {
  const Points<3> X = points(mesh);
  const Elements<3> T = elements(mesh);
  const auto is_near = [&](const Vector<3>& x) {
    return std::any_of(places.begin(), places.end(), [&](const Vector<3>& place) {
      return (x - place).squaredNorm() <= radius * radius;
    });
  };
  std::vector<char> is_vertex_near(X.rows()), flags(T.rows());
  for (Eigen::Index i = 0; i < X.rows(); ++i) is_vertex_near[i] = is_near(X.row(i).transpose());
  for (int t = 0; t < int(T.rows()); ++t)
    flags[t] = is_vertex_near[T(t, 0)] || is_vertex_near[T(t, 1)] || is_vertex_near[T(t, 2)] ||
               is_near(centroid(X, T, t));
  return flags;
}

}  // namespace

MovingSurface::MovingSurface(const Triangles& initial, const MovingSurfaceOptions& options)
    : MovingMesh<3>(options), mesh_(to_mesh(initial)) {
  find_obstacles();
  if (options.topology != Topology::kFixed) resolve_initial_crossings();
  if (options.box) clip_at_start();
  find_obstacles();
  mend_mesh(kRoundsAtTheStart);
  // A round collapses once at each place: until few are left, whose turns come in the steps.
  for (int round = 0; round < kRoundsAtTheStart && !options.stop.stop_requested(); ++round) {
    const auto n_before = mesh_.n_faces();
    mend_whole();
    if (mesh_.n_faces() > kShareLeftAtTheStart * double(n_before)) break;
  }
  approach_held_points();
  options_.stop = {};  // a run that was stopped ends with a whole step, so that it can be repeated
  find_part();
}

Triangles MovingSurface::simplices() const { return to_triangles(mesh_); }

void MovingSurface::hold_sheets_apart(const Points<3>& from, Points<3>& to,
                                      const Elements<3>& T) const {
  for (int round = 0; round < kGuardRounds && options_.sheet_distance > 0; ++round) {
    const std::vector<char> touched =
        vertices_in_contact(from, to, T, options_.sheet_distance * options_.edge_length_mm);
    Eigen::Index n_touched = 0;
    for (Eigen::Index i = 0; i < to.rows(); ++i)
      if (touched[i] && to.row(i) != from.row(i)) {
        to.row(i) = from.row(i);
        ++n_touched;
      }
    if (n_touched == 0) break;
  }
  hold_intersecting(from, to, T);
}

/// With a free topology, near the points that surgery would have passed over.
void MovingSurface::hold_contested_sheets(const Points<3>& from, Points<3>& to,
                                          const Elements<3>& T) const {
  if (contested().empty()) return;
  const double resolution = topology_resolution();
  std::vector<int> near;
  for (int t = 0; t < int(T.rows()); ++t) {
    Eigen::Matrix3d corners;
    for (int i = 0; i < 3; ++i) corners.row(i) = from.row(T(t, i));
    if (contested().is_near(corners, kContested * resolution + options_.held_distance_mm))
      near.push_back(t);
  }
  const Elements<3> T_near = T(near, Eigen::all);
  for (int round = 0; round < kGuardRounds; ++round) {
    const std::vector<char> touched = vertices_in_contact(from, to, T_near, kContact * resolution);
    for (Eigen::Index i = 0; i < to.rows(); ++i)
      if (touched[i]) to.row(i) = from.row(i);
  }
  hold_intersecting(from, to, T_near);
}

/// What a move that was bounded may not do is taken back, vertex by vertex.
void MovingSurface::hold(const Points<3>& from, Points<3>& to, const Elements<3>& T) const {
  const Points<3> limited = to;
  do {
    if (options_.topology == Topology::kFixed) {
      hold_sheets_apart(from, to, T);
    } else {
      hold_contested_sheets(from, to, T);
      hold_intersecting(from, to, T, HeldPairs::kNone);
    }
  } while (!obstacles().empty() && obstacles().hold(from, limited, T, to) > 0);
}

double MovingSurface::restrict_whole(Points<3>& to) {
  const Points<3> from = points(mesh_);
  const Elements<3> T = elements(mesh_);
  bound_move(from, T, to);
  const Points<3> wanted = to;
  hold(from, to, T);
  return share_of_vertices<3>(from, T, held_vertices<3>(from, wanted, to));
}

namespace {

/// Triangles that moved and now intersect others, or came close to them.
std::vector<char> triangles_at_events(const Points<3>& from, const Points<3>& to,
                                      const Elements<3>& T, double distance) {
  std::vector<char> has_moved(T.rows(), 0), is_event(T.rows(), 0);
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < 3; ++i) has_moved[t] |= to.row(T(t, i)) != from.row(T(t, i));
  for (const auto& [a, b] : self_intersections(to, T, has_moved)) is_event[a] = is_event[b] = 1;
  for (const auto& [a, b] : triangles_in_contact(from, to, T, distance))
    is_event[a] = is_event[b] = 1;
  return is_event;
}

bool is_any(const std::vector<char>& flags) {
  return std::find(flags.begin(), flags.end(), 1) != flags.end();
}

}  // namespace

void MovingSurface::move_whole_to(const Points<3>& to) {
  if (options_.topology != Topology::kFixed) {
    if (!displacement_.is_valid()) mesh_.add_property(displacement_);
    for (const auto vertex : mesh_.vertices())
      mesh_.property(displacement_, vertex) =
          to.row(vertex.idx()).transpose() - mesh_.point(vertex);
  }
  set_points(mesh_, to);
}

/// After a move: surgery where it has brought sheets together.
bool MovingSurface::resolve_events() {
  if (!displacement_.is_valid()) return false;
  const Points<3> to = points(mesh_);
  Points<3> from = to;
  for (const auto vertex : mesh_.vertices())
    from.row(vertex.idx()) -= mesh_.property(displacement_, vertex).transpose();
  const Elements<3> T = elements(mesh_);
  const std::vector<char> events =
      triangles_at_events(from, to, T, kContact * topology_resolution());
  if (!is_any(events)) return false;
  const TriMesh before = mesh_;
  const std::size_t n_events_before = events_.size();
  const auto take_back = [&] {
    mesh_ = before;
    events_.resize(n_events_before);
    Points<3> held = to;
    do {
      hold_sheets_apart(from, held, T);
    } while (!obstacles().empty() && obstacles().hold(from, to, T, held) > 0);
    set_points(mesh_, held);
    return true;
  };
  SurgeryOptions surgery;
  surgery.resolution_mm = topology_resolution();
  if (options_.topology == Topology::kGenus0) surgery.max_genus = 0;
  const SurgeryReport report = operate(mesh_, events, surgery, [this](auto vertex, auto a, auto b) {
    mesh_.property(displacement_, vertex) =
        (mesh_.property(displacement_, a) + mesh_.property(displacement_, b)) / 2;
  });
  has_vanished_ = mesh_.n_faces() == 0;
  if (report.n_unresolved > 0 || has_vanished_) return take_back();
  if (!report.refused.empty() && !hold_refused(report.refused)) return take_back();
  for (const RebuiltRegion& region : report.regions) {
    if (region.change == TopologyChange::kUntangling) continue;
    events_.push_back({region.change, region.place, region.volume_change_mm3});
  }
  remove_phantoms_and_crumbs();
  bring_into_box();
  if (!obstacles().empty()) {
    push_away();
    if (const auto lost = lost_obstacles(); !lost.empty()) {
      contest(lost);
      return take_back();
    }
  }
  note_rebuilt(to);
  return true;
}

/// Surgery's grid knows nothing of the box. A vertex beyond it would come back with the next move,
/// however short: J then rises at steps of any length, and the evolution ends. So it is put on the
/// face, unless triangles came to intersect; all others keep their places to the last bit.
void MovingSurface::bring_into_box() {
  if (!options_.box) return;
  const Points<3> from = points(mesh_);
  Points<3> to = from;
  for (Eigen::Index i = 0; i < to.rows(); ++i)
    if (options_.box->is_beyond(from.row(i).transpose()))
      to.row(i) = options_.box->clamped(from.row(i).transpose()).transpose();
  if (to == from) return;
  hold_intersecting(from, to, elements(mesh_));
  set_points(mesh_, to);
}

/// Moves elements that reach into obstacles out of them, where no triangles come to intersect. The
/// points that they still come too near to.
std::vector<Vector<3>> MovingSurface::push_away() {
  if (obstacles().empty()) return {};
  const Points<3> from = points(mesh_);
  const Elements<3> T = elements(mesh_);
  Points<3> to = from;
  if (obstacles().push_away(T, to)) {
    hold_intersecting(from, to, T);
    set_points(mesh_, to);
  }
  std::vector<Vector<3>> out;
  for (const std::size_t k : obstacles().violated(T, to)) out.push_back(obstacles().points()[k]);
  return out;
}

/// Vertices of refused events go back to where they were before the move; false if the surface then
/// still intersects itself.
bool MovingSurface::hold_refused(const std::vector<char>& refused) {
  const Elements<3> T = elements(mesh_);
  Points<3> to = points(mesh_), from = to;
  for (const auto vertex : mesh_.vertices())
    from.row(vertex.idx()) -= mesh_.property(displacement_, vertex).transpose();
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; refused[t] && i < 3; ++i) to.row(T(t, i)) = from.row(T(t, i));
  hold_sheets_apart(from, to, T);
  set_points(mesh_, to);
  return self_intersections({to, T}).empty();
}

/// Whether an obstacle lies in the shell, whichever way its normals point.
bool MovingSurface::holds_a_point(const Triangles& surface, const std::vector<int>& of_triangle,
                                  int shell) const {
  if (obstacles().empty()) return false;
  std::vector<int> rows;
  for (int t = 0; t < int(of_triangle.size()); ++t)
    if (of_triangle[t] == shell) rows.push_back(t);
  const Triangles part{surface.points, surface.elements(rows, Eigen::all)};
  Points<3> points(Eigen::Index(obstacles().points().size()), 3);
  for (Eigen::Index k = 0; k < points.rows(); ++k) points.row(k) = obstacles().points()[k];
  const auto holds_one = [&](const Triangles& outward) {
    const std::vector<char> flags = are_inside<3>(outward, points);
    return std::find(flags.begin(), flags.end(), 1) != flags.end();
  };
  Triangles turned = part;
  turned.elements.col(1).swap(turned.elements.col(2));
  return holds_one(part) || holds_one(turned);
}

/// Shells that do not bound the domain, and those smaller than the resolution, but for such as hold
/// an obstacle.
bool MovingSurface::remove_phantoms_and_crumbs() {
  const Triangles surface = simplices();
  const ShellHierarchy hierarchy = shell_hierarchy(surface);
  std::vector<char> is_gone(hierarchy.shells.size(), 0);
  int n_left = 0;
  for (std::size_t s = 0; s < is_gone.size(); ++s) {
    const Shell& shell = hierarchy.shells[s];
    is_gone[s] = !shell.is_real() || (std::abs(shell.volume_mm3) < min_content() &&
                                      !holds_a_point(surface, hierarchy.of_triangle, int(s)));
    n_left += !is_gone[s];
  }
  if (n_left == 0 || n_left == static_cast<int>(is_gone.size())) return false;
  for (std::size_t s = 0; s < is_gone.size(); ++s)
    if (is_gone[s] && hierarchy.shells[s].is_real())
      events_.push_back({TopologyChange::kVanishing, hierarchy.shells[s].center_ras_mm,
                         -hierarchy.shells[s].volume_mm3});
  for (int t = 0; t < static_cast<int>(hierarchy.of_triangle.size()); ++t)
    if (is_gone[hierarchy.of_triangle[t]]) mesh_.delete_face(OpenMesh::FaceHandle(t), true);
  collect_garbage(mesh_);
  return true;
}

/// An initial surface of balls that overlap becomes the boundary of their union.
void MovingSurface::resolve_initial_crossings() {
  std::vector<char> events(mesh_.n_faces(), 0);
  const Triangles initial = simplices();
  for (const auto& [a, b] : self_intersections(initial)) events[a] = events[b] = 1;
  SurgeryOptions surgery;
  surgery.resolution_mm = topology_resolution();
  if (operate(mesh_, events, surgery).n_unresolved > 0)
    throw InvalidMesh("the initial surface intersects itself and could not be rebuilt");
  remove_phantoms_and_crumbs();
  note_rebuilt(initial.points);
}

/// A surface that intersects itself is brought into the box by its first step.
void MovingSurface::clip_at_start() {
  if (!self_intersections(simplices()).empty()) return;
  const Points<3> before = points(mesh_);
  const Triangles inside = clipped(simplices(), *options_.box);
  if (inside.points.rows() == before.rows() && inside.points == before) return;
  mesh_ = to_mesh(inside);
  note_rebuilt(before);
}

bool MovingSurface::mend_whole() {
  has_changed_domain_ = options_.topology != Topology::kFixed && resolve_events();
  const bool is_mended = mend_mesh(kRoundsInAStep);
  take_up_obstacles();
  return is_mended || has_changed_domain_;
}

/// The checks of what mends are local. Where far parts come to intersect, or reach into an obstacle
/// and cannot be moved out of it, it begins anew and leaves
/// wider and wider surroundings of these places as they are; in the end all is only refined.
bool MovingSurface::mend_mesh(int max_rounds) {
  const TriMesh unmended = mesh_;
  std::vector<Vector<3>> frozen_places;
  double radius = kFrozenRadius * options_.edge_length_mm;
  for (int round = 0; round < kMendingRounds; ++round, radius *= 2) {
    const bool has_changed = mend_apart_from(frozen_places, radius, max_rounds);
    const std::vector<Vector<3>> too_near = push_away();
    const Triangles mended = to_triangles(mesh_);
    const auto added = added_intersections(to_triangles(unmended), mended);
    if (added.empty() && too_near.empty())
      return (!frozen_places.empty() && mend_the_rest(mended)) || has_changed;
    for (const auto& [first, second] : added)
      for (const int triangle : {first, second})
        frozen_places.push_back(centroid(mended.points, mended.elements, triangle));
    frozen_places.insert(frozen_places.end(), too_near.begin(), too_near.end());
    mesh_ = unmended;
    if (options_.stop.stop_requested()) return false;
  }
  AdaptivityOptions sizes = adaptivity();
  sizes.gamma_coarsen = 0;
  return adapt(mesh_, sizes, max_rounds).n_refined > 0;
}

/// The frozen places by shorter and shorter moves; whether it has changed any.
bool MovingSurface::mend_the_rest(const Triangles& mended) {
  const TriMesh before = mesh_;
  for (const double share : {0.5, 0.25, 0.1}) {
    ImproveOptions improvement;
    improvement.min_length = shortest_edge();
    improvement.max_length = adaptivity().max_length_mm;
    improvement.tolerance_mm = share * mending_tolerance();
    improvement.stop = options_.stop;
    improvement.frozen = unmended_elements();
    if (options_.box) improvement.box = &*options_.box;
    const ImproveReport improved = improve(mesh_, improvement);
    if (push_away().empty() && added_intersections(mended, to_triangles(mesh_)).empty())
      return improved.n_collapsed + improved.n_flipped + improved.n_moved > 0;
    mesh_ = before;
  }
  return false;
}

/// Adapts and improves all but what lies within `radius` of the places.
bool MovingSurface::mend_apart_from(const std::vector<Vector<3>>& places, double radius,
                                    int max_rounds) {
  AdaptivityOptions sizes = adaptivity();
  if (!places.empty()) sizes.gamma_coarsen = 0;
  AdaptivityReport adapted = adapt(mesh_, sizes, max_rounds, options_.stop);
  is_limited_ |= adapted.is_limited;
  ImproveOptions improvement;
  improvement.min_length = shortest_edge();
  improvement.max_length = sizes.max_length_mm;
  improvement.tolerance_mm = mending_tolerance();
  improvement.stop = options_.stop;
  if (options_.box) improvement.box = &*options_.box;
  improvement.may_coarsen = std::move(adapted.may_coarsen);
  if (sizes.geometry_tolerance_mm > 0)
    improvement.max_variation_mm = sizes.gamma_refine * sizes.geometry_tolerance_mm;
  improvement.frozen = unmended_elements();
  if (!places.empty()) {
    const std::vector<char> near = faces_near(mesh_, places, radius);
    improvement.frozen.resize(near.size(), 0);
    for (std::size_t t = 0; t < near.size(); ++t) improvement.frozen[t] |= near[t];
  }
  const ImproveReport improved = improve(mesh_, improvement);
  return adapted.n_refined + adapted.n_coarsened + improved.n_collapsed + improved.n_flipped +
             improved.n_moved >
         0;
}

}  // namespace surf::mesh
