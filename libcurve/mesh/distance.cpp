#include "libcurve/mesh/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libcurve/mesh/detail/box_tree.h"
#include "libcurve/mesh/detail/exact_segments.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

double squared_distance(const Vector<2>& p, const Vector<2>& a, const Vector<2>& b) {
  const Vector<2> side = b - a;
  const double squared = side.squaredNorm();
  const double at = squared > 0 ? std::clamp((p - a).dot(side) / squared, 0.0, 1.0) : 0;
  return (a + at * side - p).squaredNorm();
}

/// Points where the length summed over the elements reaches (k + 1/2) / n of the whole.
Points<2> samples(const Segments& curves, int n) {
  double whole = 0;
  for (const auto e : curves.elements.rowwise())
    whole += (curves.points.row(e[1]) - curves.points.row(e[0])).norm();
  if (!(whole > 0)) throw InvalidMesh("distances of curves without length");
  Points<2> out(n, 2);
  double before = 0;
  int k = 0;
  for (const auto e : curves.elements.rowwise()) {
    const Eigen::RowVector2d a = curves.points.row(e[0]), b = curves.points.row(e[1]);
    const double length = (b - a).norm();
    for (; k < n && (k + 0.5) / n * whole <= before + length; ++k)
      out.row(k) = a + ((k + 0.5) / n * whole - before) / length * (b - a);
    before += length;
  }
  for (; k < n; ++k) out.row(k) = curves.points.row(curves.elements(curves.elements.rows() - 1, 1));
  return out;
}

}  // namespace

struct DistanceToCurves::Impl {
  explicit Impl(const Segments& the_curves)
      : curves(the_curves), tree(curves.points, curves.elements, 0) {}
  Segments curves;
  BoxTree tree;
};

DistanceToCurves::DistanceToCurves(const Segments& curves) {
  check_elements(curves.points, curves.elements);
  if (curves.elements.rows() == 0) throw InvalidMesh("distance to curves without elements");
  impl_ = std::make_unique<Impl>(curves);
}
DistanceToCurves::~DistanceToCurves() = default;
DistanceToCurves::DistanceToCurves(DistanceToCurves&&) noexcept = default;

double DistanceToCurves::operator()(const Vector<2>& point) const {
  const Segments& curves = impl_->curves;
  double nearest = std::numeric_limits<double>::infinity();
  impl_->tree.for_each_near(point, nearest, [&](int e) {
    nearest = std::min(nearest, squared_distance(point, curves.points.row(curves.elements(e, 0)),
                                                 curves.points.row(curves.elements(e, 1))));
    return nearest;
  });
  return std::sqrt(nearest);
}

DistanceStatistics distances_from(const Segments& curves,
                                  const std::function<double(const Vector<2>&)>& distance,
                                  const DistanceOptions& options) {
  const auto values_at = [&](const Points<2>& points) {
    std::vector<double> values(points.rows());
    for (Eigen::Index k = 0; k < points.rows(); ++k) values[k] = distance(points.row(k));
    return values;
  };
  return mesh::distance_statistics(
      values_at(samples(curves, options.n_samples)),
      values_at(curves.points(curves.elements.reshaped(), Eigen::all)));
}

CurveDistances curve_distances(const Segments& first, const Segments& second,
                               const DistanceOptions& options) {
  const DistanceToCurves to_first(first), to_second(second);
  const auto length = [](const Segments& curves) {
    double sum = 0;
    for (const auto e : curves.elements.rowwise())
      sum += (curves.points.row(e[1]) - curves.points.row(e[0])).norm();
    return sum;
  };
  const DistanceStatistics forward = distances_from(
      first, [&](const Vector<2>& p) { return to_second(p); }, options);
  const DistanceStatistics backward = distances_from(
      second, [&](const Vector<2>& p) { return to_first(p); }, options);
  return mesh::symmetric_distances(forward, length(first), backward, length(second));
}

}  // namespace surf::curve
