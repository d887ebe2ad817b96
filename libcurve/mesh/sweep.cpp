#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "libcurve/mesh/detail/exact_segments.h"
#include "libcurve/mesh/detail/sweep_status.h"
#include "libcurve/mesh/intersections.h"

namespace surf::curve {
namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_2;
using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactPoint = ExactKernel::Point_2;

ExactPoint exact(const Point& p) { return {p.x(), p.y()}; }

/// Sign of the cross product of b - a and d - c.
int turn(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double left = (b.x() - a.x()) * (d.y() - c.y());
  const double right = (b.y() - a.y()) * (d.x() - c.x());
  // Each difference, product and the last difference is off by half an ulp.
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  const double cross = left - right, error = kRounding * (std::abs(left) + std::abs(right));
  if (cross > error) return 1;
  if (cross < -error) return -1;
  using Exact = CGAL::Exact_rational;
  const Exact exact_cross = (Exact(b.x()) - Exact(a.x())) * (Exact(d.y()) - Exact(c.y())) -
                            (Exact(b.y()) - Exact(a.y())) * (Exact(d.x()) - Exact(c.x()));
  return static_cast<int>(CGAL::sign(exact_cross));
}

/// Algorithm 9. Events are the ends of elements and the points where neighbours on the sweep line
/// cross; ends on an element are found when they are passed. The sweep line is tilted so little
/// that it passes points of equal x from bottom to top.
class Sweep {
 public:
  Sweep(const Points<2>& points, const Elements<2>& elements)
      : points_(points), elements_(elements), place_of_(elements.rows(), -1) {
    collect_ends();
  }

  /// Calls visit(elements, rounded point) at each point with several elements.
  template <class Visit>
  void run(const Visit& visit) {
    std::size_t next = 0;
    while (next < ends_.size() || !crossings_.empty()) {
      if (next == ends_.size() || comes_crossing_first(ends_[next].at)) {
        const auto first = crossings_.begin();
        exact_at_ = first->first;
        gather(place_of_[first->second]);
        crossings_.erase(first);
        starting_.clear();
        pass(visit);
        continue;
      }
      at_ = ends_[next].at;
      std::size_t last = next + 1;
      while (last < ends_.size() && ends_[last].at == at_) ++last;
      if (last == next + 2 && pass_plain(ends_[next], ends_[next + 1])) {
        next = last;
        continue;
      }
      exact_at_.reset();
      drop_crossing_here();
      starting_.clear();
      int place = -1;
      for (; next < last; ++next) {
        if (ends_[next].is_left) starting_.push_back(ends_[next].element);
        if (!ends_[next].is_left && place_of_[ends_[next].element] >= 0)
          place = place_of_[ends_[next].element];
      }
      if (place >= 0)
        gather(place);
      else
        gather_by_search();
      pass(visit);
    }
  }

 private:
  struct End {
    Point at;
    int element;
    bool is_left;
  };

  Point node(int i) const { return {points_(i, 0), points_(i, 1)}; }
  Point left(int e) const { return node(elements_(e, is_reversed_[e])); }
  Point right(int e) const { return node(elements_(e, !is_reversed_[e])); }

  void collect_ends() {
    const int n = static_cast<int>(elements_.rows());
    is_reversed_.resize(n);
    ends_.reserve(2 * n);
    for (int e = 0; e < n; ++e) {
      is_reversed_[e] = node(elements_(e, 1)) < node(elements_(e, 0));
      ends_.push_back({left(e), e, true});
      ends_.push_back({right(e), e, false});
    }
    std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) {
      return a.at.x() != b.at.x()     ? a.at.x() < b.at.x()
             : a.at.y() != b.at.y()   ? a.at.y() < b.at.y()
             : a.is_left != b.is_left ? b.is_left
                                      : a.element < b.element;
    });
  }

  bool comes_crossing_first(const Point& end) const {
    if (crossings_.empty()) return false;
    const ExactPoint& crossing = crossings_.begin()->first;
    if (end.x() < CGAL::to_interval(crossing.x()).first) return false;
    return CGAL::compare_xy(crossing, exact(end)) == CGAL::SMALLER;
  }
  void drop_crossing_here() {
    if (!crossings_.empty() && crossings_.begin()->first == exact(at_))
      crossings_.erase(crossings_.begin());
  }

  /// Where the current event lies of an element: 1 if above it, 0 on it.
  int side(int e) const {
    if (exact_at_)
      return static_cast<int>(CGAL::orientation(exact(left(e)), exact(right(e)), *exact_at_));
    return static_cast<int>(CGAL::orientation(left(e), right(e), at_));
  }

  /// The run of places whose elements contain the event, from one of them.
  void gather(int place) {
    int first = place;
    while (status_.below(first) >= 0 && side(status_.element(status_.below(first))) == 0)
      first = status_.below(first);
    below_ = status_.below(first);
    collect_run(first);
  }
  void gather_by_search() {
    below_ = status_.last_below([this](int e) { return side(e) > 0; });
    collect_run(status_.above(below_));
  }
  void collect_run(int place) {
    run_.clear();
    for (; place >= 0 && side(status_.element(place)) == 0; place = status_.above(place))
      run_.push_back(place);
    above_ = place;
  }

  /// An end at which one element goes on as another and nothing else is met: the common case. Their
  /// place on the sweep line stays.
  bool pass_plain(const End& ending, const End& starting) {
    if (ending.is_left || !starting.is_left) return false;
    const int e = ending.element, f = starting.element, place = place_of_[e];
    if (place < 0 || !share_a_node(e, f) || right(f) == starting.at) return false;
    exact_at_.reset();
    const int below = status_.below(place), above = status_.above(place);
    if (below >= 0 && side(status_.element(below)) == 0) return false;
    if (above >= 0 && side(status_.element(above)) == 0) return false;
    status_.set_element(place, f);
    place_of_[e] = -1;
    place_of_[f] = place;
    look_for_crossing(below, place);
    look_for_crossing(place, above);
    return true;
  }

  template <class Visit>
  void pass(const Visit& visit) {
    here_.clear();
    going_on_.clear();
    for (const int place : run_) {
      const int e = status_.element(place);
      here_.push_back(e);
      const bool ends = !exact_at_ && right(e) == at_;
      if (!ends) going_on_.push_back(e);
      place_of_[e] = -1;
    }
    for (const int e : starting_) {
      here_.push_back(e);
      if (right(e) != left(e)) going_on_.push_back(e);
    }
    if (here_.size() > 1) visit(here_, rounded());
    std::sort(going_on_.begin(), going_on_.end(), [this](int e, int f) {
      const int steeper = turn(left(e), right(e), left(f), right(f));
      return steeper != 0 ? steeper > 0 : e < f;
    });
    place_going_on();
    if (going_on_.empty()) {
      look_for_crossing(below_, above_);
    } else {
      look_for_crossing(below_, place_of_[going_on_.front()]);
      look_for_crossing(place_of_[going_on_.back()], above_);
    }
  }

  /// The elements that go on take the places of the run, in their new order.
  void place_going_on() {
    int last = below_;
    for (std::size_t k = 0; k < going_on_.size(); ++k) {
      if (k < run_.size()) {
        last = run_[k];
        status_.set_element(last, going_on_[k]);
      } else {
        last = status_.insert_above(last, going_on_[k]);
      }
      place_of_[going_on_[k]] = last;
    }
    for (std::size_t k = going_on_.size(); k < run_.size(); ++k) status_.erase(run_[k]);
  }

  /// A crossing in the inside of two elements that are neighbours now, further on.
  void look_for_crossing(int below, int above) {
    if (below < 0 || above < 0) return;
    const int e = status_.element(below), f = status_.element(above);
    const Point a = left(e), b = right(e), c = left(f), d = right(f);
    if (std::max(a.y(), b.y()) < std::min(c.y(), d.y())) return;
    if (CGAL::orientation(c, d, b) != CGAL::LEFT_TURN ||
        CGAL::orientation(a, b, d) != CGAL::RIGHT_TURN)
      return;
    if (CGAL::orientation(c, d, a) != CGAL::RIGHT_TURN ||
        CGAL::orientation(a, b, c) != CGAL::LEFT_TURN)
      return;
    const auto where = CGAL::intersection(ExactKernel::Line_2(exact(a), exact(b)),
                                          ExactKernel::Line_2(exact(c), exact(d)));
    if (const auto* point = where ? boost::get<ExactPoint>(&*where) : nullptr)
      crossings_.try_emplace(*point, e);
  }

  Vector<2> rounded() const {
    return exact_at_ ? Vector<2>(CGAL::to_double(exact_at_->x()), CGAL::to_double(exact_at_->y()))
                     : Vector<2>(at_.x(), at_.y());
  }

  bool share_a_node(int e, int f) const {
    return elements_(e, 0) == elements_(f, 1) || elements_(e, 1) == elements_(f, 0) ||
           elements_(e, 0) == elements_(f, 0) || elements_(e, 1) == elements_(f, 1);
  }

  const Points<2>& points_;
  const Elements<2>& elements_;
  std::vector<char> is_reversed_;
  std::vector<int> place_of_;  // of each element; -1: not on the sweep line
  std::vector<End> ends_;
  std::map<ExactPoint, int> crossings_;  // with an element through it
  SweepStatus status_;

  // The current event.
  Point at_;
  std::optional<ExactPoint> exact_at_;  // if it is a crossing
  std::vector<int> run_;                // places with elements through it
  int below_ = -1, above_ = -1;         // their neighbours
  std::vector<int> starting_, here_, going_on_;
};

}  // namespace

std::vector<Crossing> ordered_crossings(const Points<2>& points, const Elements<2>& elements) {
  check_elements(points, elements);
  std::vector<Crossing> out;
  Sweep(points, elements).run([&](const std::vector<int>& here, const Vector<2>& place) {
    std::vector<int> meeting;
    for (const int e : here)
      if (std::any_of(here.begin(), here.end(),
                      [&](int f) { return e != f && do_meet(points, elements, e, f); }))
        meeting.push_back(e);
    if (meeting.empty()) return;
    std::sort(meeting.begin(), meeting.end());
    out.push_back({place, std::move(meeting)});
  });
  return out;
}

std::vector<ElementPair> intersections_by_sweep(const Points<2>& points,
                                                const Elements<2>& elements) {
  std::vector<ElementPair> out;
  Sweep(points, elements).run([&](const std::vector<int>& here, const Vector<2>&) {
    for (std::size_t i = 0; i < here.size(); ++i)
      for (std::size_t j = i + 1; j < here.size(); ++j)
        if (do_meet(points, elements, here[i], here[j]))
          out.push_back(std::minmax(here[i], here[j]));
  });
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace surf::curve
