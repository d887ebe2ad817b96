#include "libcurve/mesh/detail/winding_rays.h"

#include <algorithm>

namespace surf::curve {

WindingRays::WindingRays(const Points<2>& points, const Elements<2>& elements)
    : points_(points), elements_(elements) {}

int WindingRays::column(const Columns& columns, double x) const {
  const double n = double(columns.first.size()) - 1;
  return static_cast<int>(std::clamp((x - columns.lower) / columns.width, 0.0, n - 1));
}

/// As many columns as let an element lie in three of them on average.
const WindingRays::Columns& WindingRays::columns(int axis) {
  Columns& out = columns_[axis];
  if (!out.first.empty()) return out;
  const Eigen::Index n = elements_.rows();
  double upper = 0, sum = 0;
  for (Eigen::Index e = 0; e < n; ++e) {
    const double a = points_(elements_(e, 0), axis), b = points_(elements_(e, 1), axis);
    out.lower = e == 0 ? std::min(a, b) : std::min({out.lower, a, b});
    upper = e == 0 ? std::max(a, b) : std::max({upper, a, b});
    sum += std::abs(b - a);
  }
  const double extent = upper - out.lower;
  out.width = std::max({extent / double(n), sum / double(2 * n), 1e-300});
  const int n_columns = static_cast<int>(std::min(double(n), std::floor(extent / out.width))) + 1;
  out.first.assign(n_columns + 1, 0);
  const auto for_each_entry = [&](const auto& visit) {
    for (Eigen::Index e = 0; e < n; ++e) {
      const double a = points_(elements_(e, 0), axis), b = points_(elements_(e, 1), axis);
      // One more on each side: the column of a ray is found by a rounded number.
      const int last = std::min(column(out, std::max(a, b) + 1e-12 * extent), n_columns - 1);
      for (int c = column(out, std::min(a, b) - 1e-12 * extent); c <= last; ++c)
        visit(c, static_cast<int>(e));
    }
  };
  for_each_entry([&](int c, int) { ++out.first[c + 1]; });
  for (int c = 0; c < n_columns; ++c) out.first[c + 1] += out.first[c];
  out.elements.resize(out.first.back());
  std::vector<int> next = out.first;
  for_each_entry([&](int c, int e) { out.elements[next[c]++] = e; });
  return out;
}

WindingRays::Sides WindingRays::sides(const ExactPoint& a, const ExactPoint& b) {
  int before = 0, on = 0;
  const bool from_below = is_flat(a, b);
  for_each_crossed(a, b, from_below,
                   [&](int, int sign, bool is_on) { (is_on ? on : before) += sign; });
  const bool is_from_right = from_below ? a.x() < b.x() : b.y() < a.y();
  return is_from_right ? Sides{before, before + on} : Sides{before + on, before};
}

}  // namespace surf::curve
