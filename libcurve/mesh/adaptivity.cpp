#include "libcurve/mesh/adaptivity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

using fem::Mark;

constexpr double kLargestTurn = std::numbers::pi / 3;  // at a node that is removed

Vector<2> side(const CurveMesh& curves, int i) {
  return curves.point(curves.next(i)) - curves.point(i);
}

/// Whether the element that comes back when node i is removed stays within what would be refined
/// again.
bool may_remove(const CurveMesh& curves, int i, const AdaptivityOptions& options) {
  const int before = curves.prev(i);
  const Vector<2> merged = curves.point(curves.next(i)) - curves.point(before);
  const double length = merged.norm();
  if (length > options.max_length_mm || !(length > 0)) return false;
  if (angle_between(side(curves, before), side(curves, i)) > kLargestTurn) return false;
  if (options.geometry_tolerance_mm == 0) return true;
  const Vector<2> left = side(curves, curves.prev(before)), right = side(curves, curves.next(i));
  const double eta = (length + left.norm()) / 2 * angle_between(left, merged) +
                     (length + right.norm()) / 2 * angle_between(merged, right);
  return eta <= options.gamma_refine * options.geometry_tolerance_mm;
}

/// Distance of node i from the line through its neighbours.
double height(const CurveMesh& curves, int i) {
  const Vector<2>& a = curves.point(curves.prev(i));
  const Vector<2>& b = curves.point(curves.next(i));
  const double length = (b - a).norm();
  return length > 0 ? std::abs(cross(b - a, curves.point(i) - a)) / length
                    : (curves.point(i) - a).norm();
}

}  // namespace

AdaptivityReport adapt(CurveMesh& curves, const AdaptivityOptions& options, int max_rounds,
                       const NodeTest& is_fixed) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  AdaptivityReport report;
  for (; report.n_rounds < max_rounds && curves.size() > 0; ++report.n_rounds) {
    const int n = curves.size();
    std::vector<Mark> marks =
        fem::adaptivity_marks(fem::Geometry<2>(curves.points(), curves.elements()), options);
    std::vector<char> is_gone(n, 0);
    int n_refined = 0, n_removed = 0;
    for (int i = 0; i < n; ++i) {
      const int before = curves.prev(i);
      if (marks[i] != Mark::kCoarsen || marks[before] != Mark::kCoarsen) continue;
      // Elements of removed nodes take part once.
      if (!may_remove(curves, i, options) || (is_fixed && is_fixed(curves, i))) continue;
      is_gone[i] = 1;
      marks[i] = marks[before] = Mark::kKeep;
      ++n_removed;
    }
    const auto n_marked = std::count(marks.begin(), marks.end(), Mark::kRefine);
    if (n + n_marked > options.max_elements) {
      report.is_limited |= n_marked > 0;
    } else {
      for (int i = 0; i < n; ++i) {
        if (marks[i] != Mark::kRefine) continue;
        curves.split(i, (curves.point(i) + curves.point(curves.next(i))) / 2);
        is_gone.push_back(0);
        ++n_refined;
      }
    }
    if (n_removed > 0) {
      const int n_before = curves.size();
      CurveMesh coarser = curves;
      coarser.remove(is_gone);
      // Components of four nodes would come down to two.
      if (coarser.size() == n_before - n_removed)
        curves = std::move(coarser);
      else
        n_removed = 0;
    }
    report.n_refined += n_refined;
    report.n_coarsened += n_removed;
    if (n_refined + n_removed > 0) continue;
    report.is_settled = true;
    break;
  }
  return report;
}

int remove_short(CurveMesh& curves, double min_length, double max_length, double tolerance,
                 const NodeTest& is_fixed, const NodeTest& rests) {
  const std::vector<int> component = curves.components();
  std::vector<int> n_left(curves.size(), 0);
  for (const int c : component) ++n_left[c];
  std::vector<char> is_gone(curves.size(), 0);
  int n_removed = 0;
  const auto is_held = [&](int i) { return is_fixed && is_fixed(curves, i); };
  const auto is_free = [&](int i) {
    return !is_gone[i] && !is_gone[curves.prev(i)] && !is_gone[curves.next(i)];
  };
  for (int i = 0; i < curves.size(); ++i) {
    if (curves.length(i) >= min_length || n_left[component[i]] <= 4) continue;
    int best = -1;
    double lowest = tolerance;
    const bool is_between = is_held(i) && is_held(curves.next(i));
    for (const int node : {i, curves.next(i)}) {
      if ((is_held(node) && !is_between) || (rests && rests(curves, node))) continue;
      const double merged =
          (curves.point(curves.next(node)) - curves.point(curves.prev(node))).norm();
      const double h = height(curves, node);
      if (!is_free(node) || h > lowest || merged > max_length || !(merged > 0)) continue;
      best = node;
      lowest = h;
    }
    if (best < 0) continue;
    is_gone[best] = 1;
    --n_left[component[i]];
    ++n_removed;
  }
  if (n_removed > 0) curves.remove(is_gone);
  return n_removed;
}

int smooth(CurveMesh& curves, const SmoothingOptions& options) {
  int n_moved = 0;
  for (int sweep = 0; sweep < options.n_sweeps; ++sweep)
    for (int i = 0; i < curves.size(); ++i) {
      const Vector<2> a = curves.point(curves.prev(i)), z = curves.point(i),
                      b = curves.point(curves.next(i));
      const double left = (z - a).norm(), right = (b - z).norm(), chord = (b - a).norm();
      if (!(std::max(left, right) > options.max_ratio * std::min(left, right))) continue;
      // On a fold the parallel leads nowhere.
      if (options.is_fixed && options.is_fixed(curves, i)) continue;
      if (!(2 * chord > left + right) || height(curves, i) > options.max_height_mm) continue;
      const Vector<2> average = (left * (a + z) + right * (z + b)) / (2 * (left + right));
      const Vector<2> along = (b - a) / chord;
      curves.set_point(i, z + (average - z).dot(along) * along);
      ++n_moved;
    }
  return n_moved;
}

}  // namespace surf::curve
