// What tests of curves share.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libcurve/mesh/verify.h"
#include "libsurf/base/types.h"

namespace surf::curve {

inline void expect_valid(const Segments& curves, const std::string& what = {}) {
  const Verification result = verify(curves);
  EXPECT_TRUE(result.passed()) << what << ": " << result.message();
}

/// The area by the shoelace formula.
inline double enclosed(const Segments& curves) {
  double twice = 0;
  for (const auto e : curves.elements.rowwise())
    twice += curves.points(e[0], 0) * curves.points(e[1], 1) -
             curves.points(e[0], 1) * curves.points(e[1], 0);
  return twice / 2;
}

/// Winding number round a point by the angles, and the distance to the nearest element.
struct Winding {
  int number = 0;
  double distance = std::numeric_limits<double>::infinity();
};
inline Winding winding_round(const Segments& curves, const Vector<2>& p) {
  Winding out;
  double angle = 0;
  for (const auto e : curves.elements.rowwise()) {
    const Vector<2> a = curves.points.row(e[0]).transpose() - p,
                    b = curves.points.row(e[1]).transpose() - p;
    angle += std::atan2(a[0] * b[1] - a[1] * b[0], a.dot(b));
    const Vector<2> side = b - a;
    const double at =
        side.squaredNorm() > 0 ? std::clamp(-a.dot(side) / side.squaredNorm(), 0.0, 1.0) : 0;
    out.distance = std::min(out.distance, (a + at * side).norm());
  }
  out.number = static_cast<int>(std::lround(angle / (2 * M_PI)));
  return out;
}

}  // namespace surf::curve
