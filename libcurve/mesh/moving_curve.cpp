#include "libcurve/mesh/moving_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/surgery.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

constexpr double kLongest = 4.0 / 3, kShortest = 0.4;      // of the wanted edge length
constexpr int kRoundsAtTheStart = 30, kRoundsInAStep = 2;  // of adaptivity
constexpr double kResolution = 0.7;                        // of topology, of the edge length
constexpr double kTolerance = 0.1;  // by which mending may move the curves, likewise
constexpr double kRatio = 2.5;      // of neighbours' lengths; bisection makes 2
constexpr int kHalvings = 12;       // of a step that catches an event
constexpr double kEdge = 0.7;       // of the indicator on both sides of an edge, at most
constexpr int kContactRounds = 3;   // of holding sheets
constexpr int kGrowingRounds = 8;   // of holding crossings, then all nodes are held

/// Share of the length whose nodes are chosen, half of each element.
template <class IsChosen>
double share_of_length(const CurveMesh& curves, const IsChosen& is_chosen) {
  double chosen = 0, all = 0;
  for (int i = 0; i < curves.size(); ++i) {
    const double length = curves.length(i);
    all += 2 * length;
    chosen += length * (int(is_chosen(i)) + int(is_chosen(curves.next(i))));
  }
  return all > 0 ? chosen / all : 0;
}

CurveMesh moved(CurveMesh curves, const Points<2>& to) {
  curves.set_points(to);
  return curves;
}

std::vector<ElementPair> events_of(const CurveMesh& curves, const Points<2>& from,
                                   double distance) {
  auto pairs = intersections(curves.points(), curves.elements());
  const auto contacts = sheets_in_contact(curves, from, distance);
  pairs.insert(pairs.end(), contacts.begin(), contacts.end());
  return pairs;
}

/// Number of places where elements of the pairs hang together, along the curve or as a pair.
int n_places(const CurveMesh& curves, const std::vector<ElementPair>& pairs) {
  std::vector<int> parent(curves.size(), -1);
  const auto find = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& [e, f] : pairs)
    for (const int i : {e, f}) parent[i] = i;
  for (const auto& [e, f] : pairs) {
    parent[find(e)] = find(f);
    for (const int i : {e, f})
      if (parent[curves.next(i)] >= 0) parent[find(i)] = find(curves.next(i));
  }
  int n = 0;
  for (int i = 0; i < curves.size(); ++i) n += parent[i] == i;
  return n;
}

/// First i with values[i] below kEdge of the largest before it and of the largest behind it and
/// nothing smaller next to it; -1 if there is none.
Eigen::Index first_valley(const Eigen::VectorXd& values) {
  double before = 0;
  for (Eigen::Index i = 1; i + 1 < values.size(); ++i) {
    before = std::max(before, values[i - 1]);
    const double behind = values.tail(values.size() - 1 - i).maxCoeff();
    if (values[i] < kEdge * std::min(before, behind) && values[i] <= values[i - 1] &&
        values[i] <= values[i + 1])
      return i;
  }
  return -1;
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

std::string MovingCurveOptions::error() const {
  const auto message = [](const char* field, double value, const char* constraint) {
    return fmt::format("MovingCurveOptions::{} = {} violates {}", field, value, constraint);
  };
  if (!(edge_length_mm > 0)) return message("edge_length_mm", edge_length_mm, "> 0");
  if (!(coarseness >= 1)) return message("coarseness", coarseness, ">= 1");
  if (!(max_displacement_mm > 0)) return message("max_displacement_mm", max_displacement_mm, "> 0");
  if (edge_indicator && !(path_spacing_mm > 0))
    return message("path_spacing_mm", path_spacing_mm, "> 0 with an edge_indicator");
  if (!(topology_resolution_mm >= 0))
    return message("topology_resolution_mm", topology_resolution_mm, ">= 0");
  if (!(min_area_mm2 >= 0)) return message("min_area_mm2", min_area_mm2, ">= 0");
  if (!(sheet_distance >= 0)) return message("sheet_distance", sheet_distance, ">= 0");
  if (topology == Topology::kGenus0)
    return "MovingCurveOptions::topology = genus0 is for surfaces: kFree or kFixed";
  return {};
}

MovingCurve::MovingCurve(const Segments& initial, const MovingCurveOptions& options)
    : mesh_(initial), options_(options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  Points<2> start = mesh_.points();
  keep_in_box(start);
  mesh_.set_points(start);
  if (options_.topology == Topology::kFree) {
    SurgeryOptions surgery;
    surgery.min_area_mm2 = min_area();
    if (!operate(mesh_, surgery).is_resolved)
      throw InvalidMesh("the initial curves intersect and could not be rebuilt");
  }
  if (mesh_.size() == 0) throw InvalidMesh("nothing is left of the initial curves");
  mend_mesh(kRoundsAtTheStart);
}

fem::Geometry<2> MovingCurve::geometry() const { return {mesh_.points(), mesh_.elements()}; }

Segments MovingCurve::segments() const { return mesh_.segments(); }

void MovingCurve::set_edge_length(double edge_length_mm) {
  options_.max_displacement_mm *= edge_length_mm / options_.edge_length_mm;
  options_.edge_length_mm = edge_length_mm;
}

void MovingCurve::set_integrands(std::vector<std::shared_ptr<const Field<2>>> integrands) {
  options_.adaptivity.integrands = std::move(integrands);
}

double MovingCurve::topology_resolution() const {
  return options_.topology_resolution_mm > 0 ? options_.topology_resolution_mm
                                             : kResolution * options_.edge_length_mm;
}

double MovingCurve::min_area() const {
  const double radius = topology_resolution();
  return options_.min_area_mm2 > 0 ? options_.min_area_mm2 : std::numbers::pi * radius * radius;
}

void MovingCurve::keep_in_box(Points<2>& to) const {
  if (!options_.box) return;
  const ImageBox& box = *options_.box;
  const Eigen::Array2d last(box.size[0] - 1, box.size[1] - 1);
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    const Eigen::Vector2d index = box.world_to_index * to.row(i).transpose();
    const Eigen::Vector2d inside = index.array().max(0).min(last);
    if (inside != index) to.row(i) = box.index_to_world * inside;
  }
}

void MovingCurve::stop_at_edges(const Points<2>& from, Points<2>& to) const {
  if (!options_.edge_indicator) return;
  Samples<2> samples;
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    const Vector<2> start = from.row(i), way = to.row(i) - from.row(i);
    const auto n = static_cast<Eigen::Index>(std::ceil(way.norm() / options_.path_spacing_mm));
    if (n < 2) continue;
    const Points<2> path = start.transpose().replicate(n + 1, 1) +
                           Eigen::VectorXd::LinSpaced(n + 1, 0, 1) * way.transpose();
    options_.edge_indicator->sample(path, Derivatives::kNone, samples);
    const Eigen::Index edge = first_valley(samples.value);
    if (edge > 0) to.row(i) = path.row(edge);
  }
}

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

/// Algorithm 10.
void MovingCurve::adjust_step(const Points<2>& from, Points<2>& to) const {
  if (options_.step_adjustment == StepAdjustment::kNone) return;
  const int limit = options_.step_adjustment == StepAdjustment::kCatchFirst ? 2 : 1;
  const Points<2> wanted = to;
  const auto n_events = [&](double share) {
    to = from + share * (wanted - from);
    const CurveMesh there = moved(mesh_, to);
    return n_places(there, events_of(there, from, kContact * topology_resolution()));
  };
  if (n_events(1) <= limit) return;
  double without = 0, with = 1;
  for (int halving = 0; halving < kHalvings; ++halving) {
    const double middle = (without + with) / 2;
    const int n = n_events(middle);
    if (n > 0 && n <= limit) return;
    (n == 0 ? without : with) = middle;
  }
  to = from + with * (wanted - from);
}

double MovingCurve::restrict_move(Points<2>& to) {
  keep_in_box(to);
  const Points<2> from = mesh_.points();
  stop_at_edges(from, to);
  const Points<2> wanted = to;
  if (options_.topology == Topology::kFixed)
    hold_sheets_apart(from, to);
  else
    adjust_step(from, to);
  if (options_.topology != Topology::kFixed) return 0;
  return share_of_length(
      mesh_, [&](int i) { return to.row(i) == from.row(i) && wanted.row(i) != from.row(i); });
}

void MovingCurve::move_to(const Points<2>& to) {
  before_ = mesh_.points();
  mesh_.set_points(to);
}

bool MovingCurve::resolve_events() {
  if (before_.rows() == 0) return false;
  const CurveMesh at_move = mesh_;
  const Points<2> before = std::exchange(before_, Points<2>());
  SurgeryOptions surgery;
  surgery.resolution_mm = topology_resolution();
  surgery.min_area_mm2 = min_area();
  const SurgeryReport report = operate(mesh_, surgery, before);
  has_vanished_ = mesh_.size() == 0;
  if (!report.is_resolved || has_vanished_) {
    mesh_ = at_move;
    mesh_.set_points(before);
    ++n_taken_back_;
    return true;
  }
  events_.insert(events_.end(), report.events.begin(), report.events.end());
  return report.has_changed;
}

std::vector<flow::TopologyEvent> MovingCurve::take_events() { return std::exchange(events_, {}); }

bool MovingCurve::mend() {
  has_changed_domain_ = options_.topology == Topology::kFree && resolve_events();
  before_.resize(0, 2);
  return mend_mesh(kRoundsInAStep) || has_changed_domain_;
}

bool MovingCurve::mend_mesh(int max_rounds) {
  const CurveMesh unmended = mesh_;
  AdaptivityOptions sizes = options_.adaptivity;
  sizes.min_length_mm = kLongest * options_.edge_length_mm;
  sizes.max_length_mm = options_.coarseness * sizes.min_length_mm;
  const double tolerance = kTolerance * options_.edge_length_mm;
  int n_removed = 0;
  for (int round = 0; round < max_rounds; ++round) {
    const int n =
        remove_short(mesh_, kShortest * options_.edge_length_mm, sizes.max_length_mm, tolerance);
    n_removed += n;
    if (n == 0) break;
  }
  const AdaptivityReport adapted = adapt(mesh_, sizes, max_rounds);
  is_limited_ |= adapted.is_limited;
  const int n_moved = smooth(mesh_, {.max_ratio = kRatio, .max_height_mm = tolerance});
  if (n_removed + adapted.n_coarsened + n_moved == 0) return adapted.n_refined > 0;
  if (intersections(mesh_.points(), mesh_.elements()).empty()) return true;
  // Its checks are local. Where far parts come to intersect that is an event like others, unless
  // the topology is fixed: then only refinement is left.
  if (options_.topology == Topology::kFree) {
    SurgeryOptions surgery;
    surgery.min_area_mm2 = min_area();
    const SurgeryReport report = operate(mesh_, surgery);
    if (report.is_resolved && mesh_.size() > 0) {
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

std::string MovingCurve::obstacle() const {
  const fem::Geometry<2> shape = geometry();
  if (has_vanished_ || shape.radius() < options_.min_radius * options_.edge_length_mm)
    return fmt::format("the object vanished: its area fell to {:.3g} mm^2", shape.enclosed());
  const double share = border_share();
  if (share > options_.max_border_share)
    return fmt::format("the curve meets the image's border with {:.0f} % of its length",
                       100 * share);
  return {};
}

double MovingCurve::border_share() const {
  if (!options_.box) return 0;
  constexpr double kNear = 1e-6;  // pixels
  const ImageBox& box = *options_.box;
  const Eigen::Array2d last(box.size[0] - 1, box.size[1] - 1);
  return share_of_length(mesh_, [&](int i) {
    const Eigen::Array2d index = (box.world_to_index * mesh_.point(i)).array();
    return (index <= kNear).any() || (index >= last - kNear).any();
  });
}

}  // namespace surf::curve
