#include "libcurve/mesh/surgery.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>

#include "libcurve/mesh/detail/reconnection.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"
#include "libsurf/base/products.h"
#include "libsurf/mesh/point_obstacles.h"

namespace surf::curve {
namespace {

constexpr double kAlong = 3;       // of the distance: nearer elements are one sheet
constexpr double kShortest = 0.3;  // of the resolution: elements that are bridged
constexpr double kLongest = 2;     // of the resolution: elements at events
constexpr double kFacing = -0.17;  // cosine of the normals: 100 degrees
constexpr double kOverlap = 0.05;  // of the resolution: by which bridges reach into sheets
constexpr int kRefinements = 30;

double distance_to(const Vector<2>& p, const Vector<2>& a, const Vector<2>& b) {
  const Vector<2> side = b - a;
  const double squared = side.squaredNorm();
  const double at = squared > 0 ? std::clamp((p - a).dot(side) / squared, 0.0, 1.0) : 0;
  return (a + at * side - p).norm();
}

/// Of two segments that do not cross.
double segment_distance(const Vector<2>& a, const Vector<2>& b, const Vector<2>& c,
                        const Vector<2>& d) {
  return std::min(std::min(distance_to(a, c, d), distance_to(b, c, d)),
                  std::min(distance_to(c, a, b), distance_to(d, a, b)));
}

Vector<2> normal(const Vector<2>& a, const Vector<2>& b) {
  return Vector<2>(b[1] - a[1], a[0] - b[0]).normalized();
}

/// +1: they face each other across the outside, a gap; -1: across the domain, a wall; 0: they do
/// not.
int facing(const Vector<2>& a, const Vector<2>& b, const Vector<2>& c, const Vector<2>& d) {
  const Vector<2> n = normal(a, b), m = normal(c, d), between = (c + d - a - b) / 2;
  if (!(n.dot(m) < kFacing)) return 0;
  if (n.dot(between) > 0 && m.dot(between) < 0) return 1;
  if (n.dot(between) < 0 && m.dot(between) > 0) return -1;
  return 0;
}

bool are_near_along(const CurveMesh& curves, int e, int f, double length) {
  double forward = 0, backward = 0;
  for (int i = curves.next(e); forward <= length && i != e; i = curves.next(i)) {
    if (i == f) return true;
    forward += curves.length(i);
  }
  for (int i = curves.prev(e); backward <= length && i != e; i = curves.prev(i)) {
    if (i == f) return true;
    backward += curves.length(i);
  }
  return false;
}

/// The convex hull of four points, counter-clockwise.
std::vector<Vector<2>> hull(std::array<Vector<2>, 4> points) {
  std::sort(points.begin(), points.end(), [](const Vector<2>& a, const Vector<2>& b) {
    return a[0] != b[0] ? a[0] < b[0] : a[1] < b[1];
  });
  std::vector<Vector<2>> out;
  const auto extend = [&](std::size_t least, const Vector<2>& p) {
    while (out.size() >= least && cross(out.back() - out[out.size() - 2], p - out.back()) <= 0)
      out.pop_back();
    out.push_back(p);
  };
  for (const Vector<2>& p : points) extend(2, p);
  const std::size_t lower = out.size();
  for (int k = 2; k >= 0; --k) extend(lower + 1, points[k]);
  out.pop_back();
  return out;
}

Segments polygon_of(const std::vector<Vector<2>>& points) {
  const int n = static_cast<int>(points.size());
  std::vector<std::array<int, 2>> elements;
  for (int i = 0; i < n; ++i) elements.push_back({i, (i + 1) % n});
  return {points_of<2>(points), elements_of(elements)};
}

class Surgery {
 public:
  Surgery(CurveMesh& curves, const SurgeryOptions& options, const Points<2>& before)
      : curves_(curves), options_(options), before_(before) {}

  SurgeryReport run() {
    const CurveMesh unchanged = curves_;
    refine_events();
    report_.is_resolved = reconnect_all();
    if (report_.is_resolved) {
      drop_phantoms_and_crumbs();
    } else {
      report_.events.clear();
      report_.has_changed = false;
    }
    if (!report_.has_changed) curves_ = unchanged;
    return report_;
  }

 private:
  std::vector<ElementPair> contacts() const {
    if (before_.rows() == 0 || options_.resolution_mm == 0) return {};
    return sheets_in_contact(curves_, before_, kContact * options_.resolution_mm);
  }

  /// Algorithm 11: elements at events down to the resolution.
  void refine_events() {
    const double longest = kLongest * options_.resolution_mm;
    for (int round = 0; round < kRefinements && longest > 0; ++round) {
      std::vector<char> is_event(curves_.size(), 0);
      const auto pairs = round == 0
                             ? intersections(curves_.points(), curves_.elements())
                             : intersections(curves_.points(), curves_.elements(), at_events_);
      for (const auto& [e, f] : pairs) is_event[e] = is_event[f] = 1;
      for (const auto& [e, f] : contacts()) is_event[e] = is_event[f] = 1;
      at_events_ = is_event;
      int n_split = 0;
      for (int i = 0; i < int(is_event.size()); ++i) {
        if (!is_event[i] || curves_.length(i) <= longest) continue;
        bisect(i);
        at_events_.push_back(1);
        ++n_split;
      }
      if (n_split == 0) return;
    }
  }

  void bisect(int i) {
    const int end = curves_.next(i);
    if (before_.rows() > 0) {
      before_.conservativeResize(before_.rows() + 1, 2);
      before_.row(before_.rows() - 1) = (before_.row(i) + before_.row(end)) / 2;
    }
    curves_.split(i, (curves_.point(i) + curves_.point(end)) / 2);
  }

  bool reconnect_all() {
    std::vector<Segments> parts = {curves_.segments()};
    const int n_real = curves_.size();
    for (const auto& [e, f] : bridged_pairs()) parts.push_back(bridge(e, f));
    Segments now = joined(parts);
    origin_.assign(now.points.rows(), -1);
    std::iota(origin_.begin(), origin_.begin() + n_real, 0);
    const double scale = scale_of(now);
    for (int round = 0; round < options_.max_rounds; ++round) {
      const auto pairs = intersections(now.points, now.elements);
      if (pairs.empty()) {
        if (report_.has_changed) curves_ = CurveMesh(now);
        return true;
      }
      report_.has_changed = true;
      Reconnection next = reconnect(now, pairs, round == 0 ? n_real : int(now.elements.rows()),
                                    scale, options_.min_area_mm2);
      now = std::move(next.curves);
      keep_track(next.kept_nodes, now.points.rows());
      // Later rounds mend what rounding did.
      if (round == 0) report_.events = std::move(next.events);
      if (now.elements.rows() == 0) {
        curves_ = CurveMesh();
        return true;
      }
    }
    return false;
  }

  void keep_track(const std::vector<int>& kept_nodes, Eigen::Index n_nodes) {
    std::vector<int> origin(n_nodes, -1);
    for (std::size_t i = 0; i < kept_nodes.size(); ++i) origin[i] = origin_[kept_nodes[i]];
    origin_ = std::move(origin);
  }

  double scale_of(const Segments& curves) const {
    if (options_.resolution_mm > 0) return options_.resolution_mm;
    double sum = 0;
    for (const auto e : curves.elements.rowwise())
      sum += (curves.points.row(e[1]) - curves.points.row(e[0])).norm();
    return sum / double(curves.elements.rows());
  }

  /// Sheets in contact. Where sheets cross already no bridge is wanted; nor from elements much
  /// shorter than the resolution, whose normals say little and of which there may be many.
  std::vector<ElementPair> bridged_pairs() const {
    std::vector<char> is_out(curves_.size(), 0);
    for (const auto& [e, f] : intersections(curves_.points(), curves_.elements()))
      is_out[e] = is_out[f] = 1;
    for (int i = 0; i < curves_.size(); ++i)
      is_out[i] |= curves_.length(i) < kShortest * options_.resolution_mm;
    std::vector<ElementPair> out;
    for (const auto& [e, f] : contacts())
      if (!is_out[e] && !is_out[f]) out.emplace_back(e, f);
    return out;
  }

  /// A polygon that makes the gap between two elements part of the domain, or cuts the wall.
  Segments bridge(int e, int f) const {
    const Vector<2> a = curves_.point(e), b = curves_.point(curves_.next(e)), c = curves_.point(f),
                    d = curves_.point(curves_.next(f));
    const int sense = facing(a, b, c, d);
    const double reach = -sense * kOverlap * options_.resolution_mm;
    const Vector<2> n = reach * normal(a, b), m = reach * normal(c, d);
    const Segments out = polygon_of(hull({a + n, b + n, c + m, d + m}));
    return sense > 0 ? out : flipped(out);
  }

  /// Components most of whose length turned over in the move have shrunk through themselves: a disc
  /// that moves inward by more than its radius comes out on the other side with winding number one.
  std::vector<char> turned_over(const CurveHierarchy& hierarchy) const {
    std::vector<double> turned(hierarchy.components.size(), 0);
    for (int i = 0; i < curves_.size() && before_.rows() > 0; ++i) {
      const int a = origin_[i], b = origin_[curves_.next(i)];
      if (a < 0 || b < 0) continue;
      const Vector<2> now = curves_.point(curves_.next(i)) - curves_.point(i);
      const bool is_turned = now.dot(before_.row(b) - before_.row(a)) < 0;
      turned[hierarchy.of_element[i]] += is_turned ? now.norm() : -now.norm();
    }
    std::vector<char> out;
    for (const double balance : turned) out.push_back(balance > 0);
    return out;
  }

  bool holds_a_point(const CurveHierarchy& hierarchy, int component) const {
    if (options_.kept_points.empty()) return false;
    std::vector<int> rows;
    for (int i = 0; i < curves_.size(); ++i)
      if (hierarchy.of_element[i] == component) rows.push_back(i);
    Segments part{curves_.points(), curves_.elements()(rows, Eigen::all)};
    Points<2> points(Eigen::Index(options_.kept_points.size()), 2);
    for (Eigen::Index k = 0; k < points.rows(); ++k) points.row(k) = options_.kept_points[k];
    std::vector<char> flags = mesh::are_inside<2>(part, points);
    part.elements.col(0).swap(part.elements.col(1));
    for (const char flag : mesh::are_inside<2>(part, points)) flags.push_back(flag);
    return std::find(flags.begin(), flags.end(), 1) != flags.end();
  }

  void drop_phantoms_and_crumbs() {
    if (curves_.size() == 0) return;
    const CurveHierarchy hierarchy = curve_hierarchy(curves_.segments());
    const auto& parts = hierarchy.components;
    std::vector<int> by_depth(parts.size());
    for (std::size_t n = 0; n < parts.size(); ++n) by_depth[n] = static_cast<int>(n);
    std::stable_sort(by_depth.begin(), by_depth.end(),
                     [&](int a, int b) { return parts[a].depth < parts[b].depth; });
    std::vector<char> is_crumb(parts.size(), 0), is_gone(parts.size(), 0), is_made(parts.size(), 0);
    for (int i = 0; i < curves_.size(); ++i) is_made[hierarchy.of_element[i]] |= origin_[i] < 0;
    const std::vector<char> is_turned = turned_over(hierarchy);
    for (const int n : by_depth) {
      const bool is_small = is_turned[n] || (std::abs(parts[n].area_mm2) < options_.min_area_mm2 &&
                                             !holds_a_point(hierarchy, n));
      is_crumb[n] =
          parts[n].is_real() && (is_small || (parts[n].parent && is_crumb[*parts[n].parent]));
      is_gone[n] =
          !parts[n].is_real() || is_crumb[n] || (parts[n].parent && is_crumb[*parts[n].parent]);
      if (!is_gone[n]) continue;
      report_.has_changed = true;
      if (is_made[n] && std::abs(parts[n].area_mm2) < options_.min_area_mm2) {
        ++report_.n_crumbs;
        report_.crumb_area_mm2 += std::abs(parts[n].area_mm2);
        continue;
      }
      flow::TopologyEvent event;
      event.kind = flow::TopologyChange::kVanishing;
      event.place << parts[n].centre, 0;
      event.enclosed_change = -parts[n].area_mm2;
      report_.events.push_back(event);
    }
    if (std::find(is_gone.begin(), is_gone.end(), 1) == is_gone.end()) return;
    std::vector<char> goes(curves_.size());
    for (int i = 0; i < curves_.size(); ++i) goes[i] = is_gone[hierarchy.of_element[i]];
    curves_.remove(goes);
  }

  CurveMesh& curves_;
  SurgeryOptions options_;
  Points<2> before_;
  std::vector<char> at_events_;
  std::vector<int> origin_;  // of each node: its number before reconnections, -1 for new ones
  SurgeryReport report_;
};

}  // namespace

std::string SurgeryOptions::error() const {
  if (!(resolution_mm >= 0))
    return fmt::format("SurgeryOptions::resolution_mm = {} violates >= 0", resolution_mm);
  if (!(min_area_mm2 >= 0))
    return fmt::format("SurgeryOptions::min_area_mm2 = {} violates >= 0", min_area_mm2);
  if (max_rounds < 1)
    return fmt::format("SurgeryOptions::max_rounds = {} violates >= 1", max_rounds);
  return {};
}

std::vector<std::pair<int, int>> sheets_in_contact(const CurveMesh& curves, const Points<2>& before,
                                                   double distance) {
  assert(before.rows() == curves.size());
  std::vector<std::pair<int, int>> out;
  for (const auto& [e, f] : near_pairs(curves.points(), curves.elements(), distance)) {
    const int e_end = curves.next(e), f_end = curves.next(f);
    const Vector<2>&a = curves.point(e), &b = curves.point(e_end), &c = curves.point(f),
          &d = curves.point(f_end);
    // Sheets that passed through each other seem to face each other the other way.
    const int sense = facing(a, b, c, d);
    if (sense == 0 ||
        sense != facing(before.row(e), before.row(e_end), before.row(f), before.row(f_end)))
      continue;
    const double now = segment_distance(a, b, c, d);
    if (!(now < distance)) continue;
    const double then =
        segment_distance(before.row(e), before.row(e_end), before.row(f), before.row(f_end));
    if (now < then && !are_near_along(curves, e, f, kAlong * distance)) out.emplace_back(e, f);
  }
  return out;
}

SurgeryReport operate(CurveMesh& curves, const SurgeryOptions& options, const Points<2>& before) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return Surgery(curves, options, before).run();
}

}  // namespace surf::curve
