// The torus of all tests and studies.
#pragma once

#include <cmath>
#include <numbers>

#include "libsurf/base/types.h"

namespace surf::test {

/// About the z axis with radii R > r: n_around rings of n_across vertices, each quad split in two.
/// Outward.
inline Triangles torus_triangles(double R, double r, int n_around, int n_across) {
  Triangles out{Points<3>(n_around * n_across, 3), Elements<3>(2 * n_around * n_across, 3)};
  const auto index = [&](int i, int j) { return i % n_around * n_across + j % n_across; };
  for (int i = 0; i < n_around; ++i)
    for (int j = 0; j < n_across; ++j) {
      const double u = 2 * std::numbers::pi * i / n_around, v = 2 * std::numbers::pi * j / n_across;
      const double rho = R + r * std::cos(v);
      out.points.row(index(i, j)) << rho * std::cos(u), rho * std::sin(u), r * std::sin(v);
      const int row = 2 * index(i, j);
      out.elements.row(row) << index(i, j), index(i + 1, j), index(i + 1, j + 1);
      out.elements.row(row + 1) << index(i, j), index(i + 1, j + 1), index(i, j + 1);
    }
  return out;
}

}  // namespace surf::test
