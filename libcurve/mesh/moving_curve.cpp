#include "libcurve/mesh/moving_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "libcurve/mesh/adaptivity.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/surgery.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

constexpr int kRoundsAtTheStart = 30, kRoundsInAStep = 2;  // of adaptivity
constexpr double kRatio = 2.5;     // of neighbours' lengths; bisection makes 2
constexpr double kContested = 2;   // resolutions: nearer to a contested point sheets stay apart
constexpr int kContactRounds = 3;  // of holding sheets
constexpr int kGrowingRounds = 8;  // of holding crossings, then all nodes are held

CurveMesh moved(CurveMesh curves, const Points<2>& to) {
  curves.set_points(to);
  return curves;
}

/// Nodes of flagged elements go back; number of nodes that had moved.
int take_back(const CurveMesh& curves, const std::vector<char>& is_held, const Points<2>& from,
              Points<2>& to) {
  int n = 0;
  for (int e = 0; e < curves.size(); ++e)
    for (const int i : {e, curves.next(e)})
      if (is_held[e] && to.row(i) != from.row(i)) {
        to.row(i) = from.row(i);
        ++n;
      }
  return n;
}

}  // namespace

MovingCurve::MovingCurve(const Segments& initial, const MovingCurveOptions& options)
    : mesh::MovingMesh<2>(options), mesh_(initial) {
  Points<2> start = mesh_.points();
  keep_in_box(start);
  mesh_.set_points(start);
  if (options_.box) {  // nodes beyond a corner come to stand in it
    std::vector<char> is_repeated(mesh_.size());
    for (int i = 0; i < mesh_.size(); ++i)
      is_repeated[i] = mesh_.point(i) == mesh_.point(mesh_.prev(i));
    mesh_.remove(is_repeated);
  }
  if (options_.topology == Topology::kFree) {
    find_obstacles();
    SurgeryOptions surgery;
    surgery.min_area_mm2 = min_content();
    surgery.kept_points = obstacles().points();
    if (!operate(mesh_, surgery).is_resolved)
      throw InvalidMesh("the initial curves intersect and could not be rebuilt");
    note_rebuilt(start);
  } else if (!intersections(mesh_.points(), mesh_.elements()).empty()) {
    throw InvalidMesh(
        "the initial curves, cut off at the image's border, meet one another or themselves, and a "
        "fixed topology keeps them so; start from others, or with a free topology");
  }
  if (mesh_.size() == 0)
    throw InvalidMesh(fmt::format(
        "nothing is left of the initial curves: none encloses {:.3g} mm^2 of the image; start from "
        "larger ones, or with shorter edges or fewer levels",
        min_content()));
  find_obstacles();
  mend_mesh(kRoundsAtTheStart);
  approach_held_points();
  find_part();
}

Segments MovingCurve::simplices() const { return mesh_.segments(); }

/// With the topology fixed: nodes of sheets about to touch stay; then those of what still meets,
/// round after round with more of the curve round it.
void MovingCurve::hold_sheets_apart(const Points<2>& from, Points<2>& to) const {
  const double distance = options_.sheet_distance * options_.edge_length_mm;
  for (int round = 0; round < kContactRounds && distance > 0; ++round) {
    std::vector<char> is_held(mesh_.size(), 0);
    for (const auto& [e, f] : sheets_in_contact(moved(mesh_, to), from, distance))
      is_held[e] = is_held[f] = 1;
    if (take_back(mesh_, is_held, from, to) == 0) break;
  }
  const Elements<2> T = mesh_.elements();
  for (int round = 0; round < kGrowingRounds; ++round) {
    std::vector<char> is_held(mesh_.size(), 0);
    for (const auto& [e, f] : intersections(to, T)) is_held[e] = is_held[f] = 1;
    for (int ring = 0; ring < (1 << round) - 1; ++ring) {
      const std::vector<char> inner = is_held;
      for (int i = 0; i < mesh_.size(); ++i)
        is_held[i] |= inner[mesh_.prev(i)] | inner[mesh_.next(i)];
    }
    if (std::find(is_held.begin(), is_held.end(), 1) == is_held.end()) return;
    take_back(mesh_, is_held, from, to);
  }
  if (!intersections(to, T).empty()) to = from;
}

/// With a free topology, near the points that surgery would have passed over.
void MovingCurve::hold_contested_sheets(const Points<2>& from, Points<2>& to) const {
  if (contested().empty()) return;
  const double resolution = topology_resolution();
  const auto is_near = [&](int e) {
    Eigen::Matrix2d corners;
    corners << from.row(e), from.row(mesh_.next(e));
    return contested().is_near(corners, kContested * resolution + options_.held_distance_mm);
  };
  for (int round = 0; round < kGrowingRounds; ++round) {
    std::vector<char> is_held(mesh_.size(), 0);
    const CurveMesh there = moved(mesh_, to);
    auto pairs = intersections(to, mesh_.elements());
    const auto contacts = sheets_in_contact(there, from, kContact * resolution);
    pairs.insert(pairs.end(), contacts.begin(), contacts.end());
    for (const auto& [e, f] : pairs)
      if (is_near(e) || is_near(f)) is_held[e] = is_held[f] = 1;
    if (take_back(mesh_, is_held, from, to) == 0) return;
  }
}

/// What a move that was bounded may not do is taken back, node by node.
void MovingCurve::hold(const Points<2>& from, Points<2>& to) const {
  const Points<2> limited = to;
  do {
    if (options_.topology == Topology::kFixed)
      hold_sheets_apart(from, to);
    else
      hold_contested_sheets(from, to);
  } while (!obstacles().empty() && obstacles().hold(from, limited, mesh_.elements(), to) > 0);
}

double MovingCurve::restrict_whole(Points<2>& to) {
  const Points<2> from = mesh_.points();
  bound_move(from, mesh_.elements(), to);
  const Points<2> wanted = to;
  hold(from, to);
  if (options_.topology != Topology::kFixed) return 0;
  return mesh::share_of_vertices<2>(from, mesh_.elements(),
                                    mesh::held_vertices<2>(from, wanted, to));
}

void MovingCurve::move_whole_to(const Points<2>& to) {
  before_ = mesh_.points();
  mesh_.set_points(to);
}

/// Moves elements that reach into obstacles out of them; false if some still do.
bool MovingCurve::push_away() {
  if (obstacles().empty()) return true;
  Points<2> to = mesh_.points();
  const Elements<2> T = mesh_.elements();
  if (obstacles().push_away(T, to)) mesh_.set_points(to);
  return obstacles().violated(T, to).empty();
}

/// After surgery; those that are lost are contested from now on.
bool MovingCurve::has_lost_obstacles() {
  if (obstacles().empty() || mesh_.size() == 0) return false;
  const bool is_clear = push_away() && intersections(mesh_.points(), mesh_.elements()).empty();
  const std::vector<std::size_t> lost = lost_obstacles();
  contest(lost);
  return !is_clear || !lost.empty();
}

bool MovingCurve::resolve_events() {
  if (before_.rows() == 0) return false;
  const CurveMesh at_move = mesh_;
  const Points<2> before = std::exchange(before_, Points<2>());
  SurgeryOptions surgery;
  surgery.resolution_mm = topology_resolution();
  surgery.min_area_mm2 = min_content();
  surgery.kept_points = obstacles().points();
  const Points<2> moved_to = mesh_.points();
  const SurgeryReport report = operate(mesh_, surgery, before);
  has_vanished_ = mesh_.size() == 0;
  if (!report.is_resolved || has_vanished_ || (report.has_changed && has_lost_obstacles())) {
    mesh_ = at_move;
    mesh_.set_points(before);
    ++n_taken_back_;
    return true;
  }
  events_.insert(events_.end(), report.events.begin(), report.events.end());
  if (report.has_changed) note_rebuilt(moved_to);
  return report.has_changed;
}

bool MovingCurve::mend_whole() {
  has_changed_domain_ = options_.topology == Topology::kFree && resolve_events();
  before_.resize(0, 2);
  const bool is_mended = mend_mesh(kRoundsInAStep);
  take_up_obstacles();
  return is_mended || has_changed_domain_;
}

/// Nodes where the curves meet the box's border or turn in one of its corners.
NodeTest MovingCurve::border_ends() const {
  if (!options_.box) return {};
  return [&box = *options_.box](const CurveMesh& curves, int i) {
    const auto faces = [&](int node) { return box.faces(curves.point(node)); };
    const unsigned here = faces(i), before = here & faces(curves.prev(i)),
                   after = here & faces(curves.next(i));
    return here != 0 && before != after;
  };
}

/// Nodes of elements that are not mended.
NodeTest MovingCurve::resting_nodes() const {
  if (!options_.region) return {};
  return [this](const CurveMesh& curves, int i) {
    const auto rests = [&](int from) {
      Eigen::Matrix2d corners;
      corners << curves.point(from).transpose(), curves.point(curves.next(from)).transpose();
      return is_unmended(corners);
    };
    return rests(i) || rests(curves.prev(i));
  };
}

bool MovingCurve::mend_mesh(int max_rounds) {
  const CurveMesh unmended = mesh_;
  AdaptivityOptions sizes = adaptivity();
  const double tolerance = mending_tolerance();
  const NodeTest is_border_end = border_ends(), rests = resting_nodes();
  const NodeTest is_fixed = [&](const CurveMesh& curves, int i) {
    return (is_border_end && is_border_end(curves, i)) || (rests && rests(curves, i));
  };
  int n_removed = 0;
  for (int round = 0; round < max_rounds; ++round) {
    const int n =
        remove_short(mesh_, shortest_edge(), sizes.max_length_mm, tolerance, is_border_end, rests);
    n_removed += n;
    if (n == 0) break;
  }
  const AdaptivityReport adapted = adapt(mesh_, sizes, max_rounds, is_fixed);
  is_limited_ |= adapted.is_limited;
  const int n_moved =
      smooth(mesh_, {.max_ratio = kRatio, .max_height_mm = tolerance, .is_fixed = is_fixed});
  if (n_removed + adapted.n_coarsened + n_moved == 0) return adapted.n_refined > 0;
  const bool is_clear = push_away();
  if (is_clear && intersections(mesh_.points(), mesh_.elements()).empty()) return true;
  // Its checks are local. Where far parts come to intersect that is an event like others, unless
  // the topology is fixed: then only refinement is left.
  if (is_clear && options_.topology == Topology::kFree) {
    SurgeryOptions surgery;
    surgery.min_area_mm2 = min_content();
    surgery.kept_points = obstacles().points();
    const Points<2> before = mesh_.points();
    const SurgeryReport report = operate(mesh_, surgery);
    note_rebuilt(before);
    if (report.is_resolved && mesh_.size() > 0 && !has_lost_obstacles()) {
      events_.insert(events_.end(), report.events.begin(), report.events.end());
      has_changed_domain_ = true;
      return true;
    }
  }
  mesh_ = unmended;
  sizes.gamma_coarsen = 0;
  if (adapt(mesh_, sizes, max_rounds).n_refined == 0) return false;
  if (intersections(mesh_.points(), mesh_.elements()).empty()) return true;
  mesh_ = unmended;  // midpoints are rounded, too
  return false;
}

}  // namespace surf::curve
