#include "libcurve/mesh/verify.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_2_algorithms.h>
#include <CGAL/box_intersection_d.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace surf::curve {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_2;
using Segment = Kernel::Segment_2;

class Check {
 public:
  explicit Check(const Segments& curves) : curves_(curves) {
    out_.n_elements = static_cast<int>(curves.elements.rows());
  }

  Verification run() {
    count_invalid();
    if (out_.n_elements == 0 || out_.n_invalid > 0) return out_;
    count_open_nodes();
    count_intersections();
    out_.closed = out_.n_open_nodes == 0;
    out_.simple = out_.closed && out_.n_degenerate == 0 && out_.n_intersections == 0;
    if (out_.closed) collect_polygons();
    if (out_.simple) check_orientations();
    return out_;
  }

 private:
  Point point(int i) const { return {curves_.points(i, 0), curves_.points(i, 1)}; }
  Point start(int e) const { return point(curves_.elements(e, 0)); }
  Point end(int e) const { return point(curves_.elements(e, 1)); }

  void count_invalid() {
    for (const auto element : curves_.elements.rowwise()) {
      const auto is_bad = [&](int node) {
        return node < 0 || node >= curves_.points.rows() || !curves_.points.row(node).allFinite();
      };
      out_.n_invalid += is_bad(element[0]) || is_bad(element[1]);
    }
  }

  void count_open_nodes() {
    std::vector<int> n_starting(curves_.points.rows(), 0), n_ending(curves_.points.rows(), 0);
    for (const auto element : curves_.elements.rowwise()) {
      ++n_starting[element[0]];
      ++n_ending[element[1]];
    }
    for (std::size_t i = 0; i < n_starting.size(); ++i)
      out_.n_open_nodes += n_starting[i] != n_ending[i] || n_starting[i] > 1;
  }

  void count_intersections() {
    using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 2, int,
                                                          CGAL::Box_intersection_d::ID_EXPLICIT>;
    std::vector<Box> boxes;
    for (int e = 0; e < out_.n_elements; ++e) {
      out_.n_degenerate += start(e) == end(e);
      boxes.emplace_back(start(e).bbox() + end(e).bbox(), e);
    }
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      const int e = std::min(a.info(), b.info()), f = std::max(a.info(), b.info());
      if (!is_intersection(e, f)) return;
      ++out_.n_intersections;
      if (out_.intersections.size() < Verification::kMaxListed)
        out_.intersections.emplace_back(e, f);
    });
    std::sort(out_.intersections.begin(), out_.intersections.end());
  }

  bool is_intersection(int e, int f) const {
    if (!CGAL::do_intersect(Segment(start(e), end(e)), Segment(start(f), end(f)))) return false;
    const auto only_share = [](const Point& common, const Point& a, const Point& b) {
      return !CGAL::collinear(a, common, b) ||
             CGAL::collinear_are_strictly_ordered_along_line(a, common, b);
    };
    const bool follows = curves_.elements(e, 1) == curves_.elements(f, 0);
    const bool precedes = curves_.elements(f, 1) == curves_.elements(e, 0);
    if (follows && precedes) return true;
    if (follows) return !only_share(end(e), start(e), end(f));
    if (precedes) return !only_share(start(e), end(e), start(f));
    return true;
  }

  void collect_polygons() {
    std::vector<int> starting(curves_.points.rows(), -1);
    for (int e = 0; e < out_.n_elements; ++e) starting[curves_.elements(e, 0)] = e;
    std::vector<char> is_done(out_.n_elements, 0);
    for (int first = 0; first < out_.n_elements; ++first) {
      if (is_done[first]) continue;
      polygons_.emplace_back();
      for (int e = first; !is_done[e]; e = starting[curves_.elements(e, 1)]) {
        is_done[e] = 1;
        polygons_.back().push_back(start(e));
      }
    }
    out_.n_components = static_cast<int>(polygons_.size());
  }

  /// Each polygon against those whose box contains its first node.
  void check_orientations() {
    std::vector<CGAL::Bbox_2> boxes;
    for (const auto& polygon : polygons_)
      boxes.push_back(CGAL::bbox_2(polygon.begin(), polygon.end()));
    for (std::size_t n = 0; n < polygons_.size(); ++n) {
      int depth = 0;
      for (std::size_t m = 0; m < polygons_.size(); ++m)
        if (m != n && CGAL::do_overlap(boxes[m], polygons_[n][0].bbox()))
          depth += CGAL::bounded_side_2(polygons_[m].begin(), polygons_[m].end(),
                                        polygons_[n][0]) == CGAL::ON_BOUNDED_SIDE;
      const bool is_outward =
          CGAL::orientation_2(polygons_[n].begin(), polygons_[n].end()) == CGAL::COUNTERCLOCKWISE;
      out_.n_misoriented_components += is_outward != (depth % 2 == 0);
    }
    out_.alternating = out_.n_misoriented_components == 0;
  }

  const Segments& curves_;
  Verification out_;
  std::vector<std::vector<Point>> polygons_;
};

std::string counted(int n, const char* noun) {
  return fmt::format("{} {}{}", n, noun, n == 1 ? "" : "s");
}

}  // namespace

Verification verify(const Segments& curves) { return Check(curves).run(); }

std::string Verification::message() const {
  if (n_elements == 0) return "no elements";
  if (n_invalid > 0) return counted(n_invalid, "element") + " with a missing or non-finite point";
  if (passed())
    return fmt::format("closed, simple, alternating; {}, {}", counted(n_elements, "element"),
                       counted(n_components, "component"));
  std::string text;
  const auto add = [&](int n, const char* noun, const std::string& more = {}) {
    if (n > 0) text += (text.empty() ? "" : ", ") + counted(n, noun) + more;
  };
  add(n_open_nodes, "open or branching node");
  add(n_degenerate, "element", " without length");
  add(n_intersections, "pair",
      intersections.empty() ? std::string()
                            : fmt::format(" of intersecting elements (first: elements {} and {})",
                                          intersections[0].first, intersections[0].second));
  add(n_misoriented_components, "component", " oriented the wrong way");
  return text;
}

}  // namespace surf::curve
