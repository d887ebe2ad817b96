#include "libcurve/mesh/primitives.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

constexpr double kMaxElements = 20e6;
constexpr double kMinElements = 8;  // of a circle

void check_positive(const char* what, double value) {
  if (!(value > 0))
    throw UsageError(fmt::format("{} of a curve: expected > 0; got {}", what, value));
}

Eigen::Index checked_count(double n) {
  if (!(n <= kMaxElements))
    throw UsageError(fmt::format("a curve of {:.3g} elements: ask for longer ones", n));
  return static_cast<Eigen::Index>(n);
}

/// Elements that close the loop 0, 1, ..., n - 1.
Elements<2> loop(Eigen::Index n) {
  Elements<2> out(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) out.row(i) << int(i), int((i + 1) % n);
  return out;
}

}  // namespace

Segments circle(const Vector<2>& centre, double radius, double edge_length) {
  check_positive("radius", radius);
  return ellipse(centre, radius * Eigen::Matrix2d::Identity(), edge_length);
}

Segments ellipse(const Vector<2>& centre, const Eigen::Matrix2d& axes, double edge_length) {
  check_positive("edge length", edge_length);
  if (!(std::abs(axes.determinant()) > 0) || !axes.allFinite())
    throw UsageError("axes of an ellipse: expected two independent vectors");
  const double longest = axes.operatorNorm();
  const double step = 2 * std::asin(std::min(1.0, edge_length / (2 * longest)));
  const Eigen::Index n =
      checked_count(std::max(kMinElements, std::ceil(2 * std::numbers::pi / step * (1 - 1e-12))));
  const double sense = axes.determinant() > 0 ? 1 : -1;
  Segments out{Points<2>(n, 2), loop(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const double angle = sense * 2 * std::numbers::pi * double(i) / double(n);
    out.points.row(i) = centre + axes * Vector<2>(std::cos(angle), std::sin(angle));
  }
  return out;
}

Segments polygon(const Points<2>& corners, double edge_length) {
  check_positive("edge length", edge_length);
  const Eigen::Index n_corners = corners.rows();
  if (n_corners < 3)
    throw UsageError(fmt::format("a polygon: expected three corners or more; got {}", n_corners));
  std::vector<Vector<2>> points;
  for (Eigen::Index i = 0; i < n_corners; ++i) {
    const Vector<2> a = corners.row(i), b = corners.row((i + 1) % n_corners);
    const double pieces = std::max(1.0, std::ceil((b - a).norm() / edge_length * (1 - 1e-12)));
    const Eigen::Index n =
        checked_count(pieces + double(points.size())) - Eigen::Index(points.size());
    for (Eigen::Index k = 0; k < n; ++k) points.emplace_back(a + double(k) / double(n) * (b - a));
  }
  return {points_of<2>(points), loop(Eigen::Index(points.size()))};
}

Segments grid_of_circles(const Vector<2>& lower, const Vector<2>& upper, double spacing,
                         double radius, double edge_length) {
  check_positive("spacing", spacing);
  const Vector<2> size = upper - lower;
  std::vector<Segments> parts;
  for (int j = 0; (j + 0.5) * spacing <= size[1]; ++j)
    for (int i = 0; (i + 0.5) * spacing <= size[0]; ++i)
      parts.push_back(circle(lower + spacing * Vector<2>(i + 0.5, j + 0.5), radius, edge_length));
  return joined(parts);
}

Segments joined(const std::vector<Segments>& parts) { return all_of(parts); }

Segments flipped(Segments curves) {
  curves.elements.col(0).swap(curves.elements.col(1));
  return curves;
}

}  // namespace surf::curve
