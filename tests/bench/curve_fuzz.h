// Random evolutions of curves with topology surgery, beside unions by CGAL's boolean operations.
#pragma once

#include <CGAL/Boolean_set_operations_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_set_2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/moving_curve.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/surgery.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/fem/geometry.h"

namespace surf::curve::fuzz {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Polygon = CGAL::Polygon_2<Kernel>;
using PolygonSet = CGAL::Polygon_set_2<Kernel>;

constexpr double kEdge = 0.1, kResolution = 0.7 * kEdge;

/// Area of a set; it may be unbounded where something went wrong, which is not looked at.
inline double area(const PolygonSet& set) {
  std::vector<CGAL::Polygon_with_holes_2<Kernel>> parts;
  set.polygons_with_holes(std::back_inserter(parts));
  Kernel::FT sum = 0;
  for (const auto& part : parts) {
    sum += part.outer_boundary().area();
    for (const auto& hole : part.holes()) sum += hole.area();
  }
  return CGAL::to_double(sum);
}

inline Polygon polygon_of(const Segments& curves, int first, int n) {
  Polygon out;
  for (int i = first; i < first + n; ++i) out.push_back({curves.points(i, 0), curves.points(i, 1)});
  return out;
}

/// The domain of valid curves.
inline PolygonSet domain(const Segments& curves) {
  PolygonSet out;
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<int> next(curves.points.rows());
  for (const auto e : curves.elements.rowwise()) next[e[0]] = e[1];
  const auto polygon = [&](int part) {
    Polygon loop;
    const int first = curves.elements(hierarchy.components[part].first_element, 0);
    int i = first;
    do {
      loop.push_back({curves.points(i, 0), curves.points(i, 1)});
      i = next[i];
    } while (i != first);
    return loop;
  };
  for (const Region& region : regions(hierarchy)) {
    std::vector<Polygon> holes;
    for (const int hole : region.holes) holes.push_back(polygon(hole));
    out.insert(
        CGAL::Polygon_with_holes_2<Kernel>(polygon(region.outer), holes.begin(), holes.end()));
  }
  return out;
}

/// A sum of waves and a shear.
struct Flow {
  Eigen::Matrix2d frequency, shear;
  Eigen::Vector2d phase;
  double amplitude = 0, normal_speed = 0;

  Eigen::Vector2d velocity(const Eigen::Vector2d& x) const {
    return shear * x + amplitude * ((frequency * x + phase).array().sin()).matrix();
  }
  Eigen::Vector2d moved(const Eigen::Vector2d& x, double dt) const {
    const Eigen::Vector2d a = velocity(x), b = velocity(x + dt / 2 * a),
                          c = velocity(x + dt / 2 * b), d = velocity(x + dt * c);
    return x + dt / 6 * (a + 2 * b + 2 * c + d);
  }
};

enum class Kind { kNormal, kField, kBoth };

struct Disc {
  Eigen::Vector2d centre;
  double radius;
};

struct Outcome {
  bool is_valid = true;
  std::string message;
  bool has_vanished = false;
  bool is_compared = false;
  double difference =
      0;  ///< area in which domain and reference differ, of longest length * resolution
  /// The same between the domains before and after a mend with events, the largest of the run:
  /// what was joined, cut, dropped and smoothed.
  double change = 0;
  int n_steps = 0, n_taken_back = 0;
  std::map<std::string, int> kinds;
};

/// Discs, up to two of them with a hole, that move along their normals, in a field, or both.
class Evolution {
 public:
  explicit Evolution(int seed) : random_(seed), kind_(Kind(seed % 3)) {
    std::uniform_real_distribution<double> uniform(-1, 1), radius(0.15, 0.6);
    const int n_discs = 1 + seed / 3 % 12;
    for (int k = 0; k < n_discs; ++k)
      discs_.push_back({2 * Eigen::Vector2d(uniform(random_), uniform(random_)), radius(random_)});
    for (double& value : flow_.frequency.reshaped()) value = 2 * uniform(random_);
    for (double& value : flow_.shear.reshaped()) value = 0.4 * uniform(random_);
    for (double& value : flow_.phase) value = 3 * uniform(random_);
    flow_.amplitude = kind_ == Kind::kNormal ? 0 : 0.6 * std::abs(uniform(random_));
    if (kind_ == Kind::kNormal) flow_.shear.setZero();
    if (kind_ != Kind::kField)
      flow_.normal_speed = std::copysign(0.2 + 0.6 * std::abs(uniform(random_)), uniform(random_));
    // Under erosion the union of discs is no union of smaller discs.
    if (kind_ == Kind::kNormal && flow_.normal_speed < 0) keep_disjoint();
    for (std::size_t k = 0; k < discs_.size() && k < 2; ++k)
      if (discs_[k].radius > 0.4 && is_alone(k))
        holes_.push_back(
            {discs_[k].centre + 0.1 * Eigen::Vector2d(uniform(random_), uniform(random_)), 0.25});
    steps_ = 10 + seed % 25;
    // From a fifth of an edge to three edges.
    dt_ = kEdge * std::pow(15.0, std::abs(uniform(random_))) / 5;
    options_.edge_length_mm = kEdge;
    if (seed % 5 == 0) {
      options_.coarseness = 4;
      options_.adaptivity.geometry_tolerance_mm = 0.02;
    }
  }

  Outcome run() {
    Outcome out;
    MovingCurve curve(initial(), options_);
    double time = 0, longest = 0;
    for (int k = 0; k < steps_ && out.is_valid && !out.has_vanished; ++k) {
      const fem::Geometry<2> shape = curve.geometry();
      const double dt = step(shape);
      longest = std::max(longest, shape.measure());
      Points<2> to = shape.points();
      for (Eigen::Index i = 0; i < to.rows(); ++i)
        to.row(i) = flow_.moved(to.row(i), dt) +
                    dt * flow_.normal_speed * shape.nodal_normals().row(i).transpose().normalized();
      curve.restrict_move(to);
      curve.move_to(to);
      const CurveMesh unmended(curve.simplices());
      const bool was_taken_back = curve.n_taken_back() > 0;
      curve.mend();
      time += dt;
      ++out.n_steps;
      out.n_taken_back = curve.n_taken_back();
      out.has_vanished = !curve.obstacle().empty();
      const auto events = curve.take_events();
      for (const auto& event : events) ++out.kinds[to_string(event.kind)];
      const Verification verification = verify(curve.simplices());
      out.is_valid = verification.passed();
      out.message = verification.message();
      if (!events.empty() && out.is_valid && curve.n_taken_back() == int(was_taken_back))
        out.change = std::max(out.change, change_by_mending(unmended, curve));
    }
    if (!out.is_valid || out.has_vanished || kind_ == Kind::kBoth) return out;
    const std::optional<PolygonSet> expected = reference(time);
    if (!expected) return out;
    out.is_compared = true;
    PolygonSet different = domain(curve.simplices());
    different.symmetric_difference(*expected);
    out.difference = area(different) / (longest * kResolution);
    return out;
  }

 private:
  /// Against the exact domain round which the moved curves wind.
  static double change_by_mending(CurveMesh unmended, const MovingCurve& curve) {
    const double length = fem::Geometry<2>(unmended.points(), unmended.elements()).measure();
    operate(unmended, {});
    PolygonSet different = domain(curve.simplices());
    if (unmended.size() > 0) different.symmetric_difference(domain(unmended.segments()));
    return area(different) / (length * kResolution);
  }

  bool is_alone(std::size_t k) const {
    for (std::size_t other = 0; other < discs_.size(); ++other)
      if (other != k && (discs_[k].centre - discs_[other].centre).norm() <
                            discs_[k].radius + discs_[other].radius + 0.1)
        return false;
    return true;
  }
  void keep_disjoint() {
    for (std::size_t k = discs_.size(); k-- > 0;)
      if (!is_alone(k) && discs_.size() > 1) discs_.erase(discs_.begin() + std::ptrdiff_t(k));
  }

  Segments initial() const {
    std::vector<Segments> parts;
    for (const Disc& disc : discs_) parts.push_back(circle(disc.centre, disc.radius, kEdge));
    for (const Disc& hole : holes_)
      parts.push_back(flipped(circle(hole.centre, hole.radius, kEdge)));
    return joined(parts);
  }

  /// So long that the fastest vertex goes dt_.
  double step(const fem::Geometry<2>& shape) const {
    double fastest = std::abs(flow_.normal_speed);
    for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
      fastest = std::max(
          fastest, flow_.velocity(shape.points().row(i)).norm() + std::abs(flow_.normal_speed));
    return dt_ / std::max(fastest, 1e-3);
  }

  /// A disc after this time, by a fine polygon.
  Polygon moved(const Disc& disc, double grown, double time) const {
    Segments fine = circle(disc.centre, disc.radius + grown, 0.02);
    constexpr int kSubsteps = 100;
    for (Eigen::Index i = 0; kind_ == Kind::kField && i < fine.points.rows(); ++i)
      for (int k = 0; k < kSubsteps; ++k)
        fine.points.row(i) = flow_.moved(fine.points.row(i), time / kSubsteps);
    return polygon_of(fine, 0, int(fine.points.rows()));
  }

  /// None where the field has drawn a polygon out so far that it crosses itself.
  std::optional<PolygonSet> reference(double time) const {
    PolygonSet out;
    const double grown = flow_.normal_speed * time;
    std::vector<Polygon> polygons;
    for (const Disc& disc : discs_)
      if (disc.radius + grown > 0) {
        polygons.push_back(moved(disc, grown, time));
        if (!polygons.back().is_simple()) return std::nullopt;
      }
    out.join(polygons.begin(), polygons.end());
    // A hole shrinks as the domain grows; discs that come into it stay.
    for (const Disc& hole : holes_) {
      if (hole.radius - grown <= 0) continue;
      const Polygon wall = moved(hole, -grown, time);
      if (!wall.is_simple()) return std::nullopt;
      PolygonSet cavity(wall);
      for (std::size_t k = 0; k < polygons.size(); ++k)
        if (!is_around(discs_[k], hole)) cavity.difference(polygons[k]);
      out.difference(cavity);
    }
    return out;
  }
  static bool is_around(const Disc& disc, const Disc& hole) {
    return (disc.centre - hole.centre).norm() < disc.radius;
  }

  std::mt19937 random_;
  Kind kind_;
  std::vector<Disc> discs_, holes_;
  Flow flow_;
  int steps_ = 0;
  double dt_ = 0;
  MovingCurveOptions options_;
};

}  // namespace surf::curve::fuzz
