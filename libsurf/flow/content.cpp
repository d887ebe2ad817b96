#include "libsurf/flow/content.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace surf::flow {
namespace {

constexpr int kNewtonSteps = 30;
constexpr double kRounding = 16;  // unit roundoffs of the sum of the parts' magnitudes

/// Content of the simplex of an element and the origin.
double part(const Points<2>& X, const Eigen::RowVector2i& t, const Vector<2>& origin) {
  const Vector<2> a = X.row(t[0]).transpose() - origin, b = X.row(t[1]).transpose() - origin;
  return (a[0] * b[1] - a[1] * b[0]) / 2;
}
double part(const Points<3>& X, const Eigen::RowVector3i& t, const Vector<3>& origin) {
  const Vector<3> a = X.row(t[0]).transpose() - origin, b = X.row(t[1]).transpose() - origin,
                  c = X.row(t[2]).transpose() - origin;
  return a.dot(b.cross(c)) / 6;
}

/// measure * nu / Dim: what an element gives to each of its vertices.
Vector<2> share(const Points<2>& X, const Eigen::RowVector2i& t) {
  const Vector<2> edge = X.row(t[1]) - X.row(t[0]);
  return Vector<2>(edge[1], -edge[0]) / 2;
}
Vector<3> share(const Points<3>& X, const Eigen::RowVector3i& t) {
  const Vector<3> a = X.row(t[1]) - X.row(t[0]), b = X.row(t[2]) - X.row(t[0]);
  return a.cross(b) / 6;
}

struct Sum {
  double value = 0, rounding = 0;
};

template <int Dim>
Sum content_sum(const Points<Dim>& X, const Elements<Dim>& T) {
  const Vector<Dim> origin = X.row(0);
  Sum sum;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const double value = part(X, T.row(t), origin);
    sum.value += value;
    sum.rounding += std::abs(value);
  }
  sum.rounding *= kRounding * std::numeric_limits<double>::epsilon();
  return sum;
}

}  // namespace

template <int Dim>
double content(const Points<Dim>& X, const Elements<Dim>& T) {
  return content_sum<Dim>(X, T).value;
}

template <int Dim>
Points<Dim> content_gradient(const Points<Dim>& X, const Elements<Dim>& T) {
  Points<Dim> out = Points<Dim>::Zero(X.rows(), Dim);
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Vector<Dim> each = share(X, T.row(t));
    for (int i = 0; i < Dim; ++i) out.row(T(t, i)) += each;
  }
  return out;
}

template <int Dim>
bool correct_content(Points<Dim>& X, const Elements<Dim>& T, const Points<Dim>& direction,
                     double target, double longest) {
  const double speed = direction.rowwise().norm().maxCoeff();
  if (!(speed > 0) || !std::isfinite(speed)) return content_sum<Dim>(X, T).value == target;
  const Points<Dim> from = X;
  double s = 0;
  for (int k = 0; k < kNewtonSteps; ++k) {
    const Sum now = content_sum<Dim>(X, T);
    if (std::abs(now.value - target) <= now.rounding) return true;
    const double slope = content_gradient<Dim>(X, T).cwiseProduct(direction).sum();
    if (std::abs(slope) * longest / speed <= now.rounding) return false;
    const double wanted = s - (now.value - target) / slope;
    s = std::clamp(wanted, -longest / speed, longest / speed);
    if (!std::isfinite(s)) break;
    X = from + s * direction;
    if (s != wanted) return false;
  }
  if (!std::isfinite(s)) X = from;
  return false;
}

template double content<2>(const Points<2>&, const Elements<2>&);
template double content<3>(const Points<3>&, const Elements<3>&);
template Points<2> content_gradient<2>(const Points<2>&, const Elements<2>&);
template Points<3> content_gradient<3>(const Points<3>&, const Elements<3>&);
template bool correct_content<2>(Points<2>&, const Elements<2>&, const Points<2>&, double, double);
template bool correct_content<3>(Points<3>&, const Elements<3>&, const Points<3>&, double, double);

}  // namespace surf::flow
