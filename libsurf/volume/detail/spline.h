// Weights of the cubic B-spline and of the Gaussian, for fields on grids of any dimension.
#pragma once

#include <array>
#include <vector>

#include "libsurf/volume/image_fields.h"

namespace surf::volume {

/// Cubic B-spline weights of the four nodes round u = base + t, and their derivatives.
struct SplineWeights {
  std::array<double, 4> value, first, second;

  explicit SplineWeights(double t) {
    const double s = 1 - t;
    value = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
             (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
    first = {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
    second = {s, 3 * t - 2, 3 * s - 2, t};
  }
};

inline double dot(const std::array<double, 4>& w, const float* c) {
  return w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
}

/// Half of a symmetric kernel, centre first.
using Kernel = std::vector<double>;

/// Gaussian of this deviation [nodes], truncated at 3 sigma, sum of the whole kernel 1; {1} for 0.
Kernel gaussian_kernel(double sigma);

/// Weights of the selective Gaussian blur of this deviation [nodes], of radius 2 sigma; {1} for 0.
Kernel selective_kernel(double sigma);

/// Weight of each side in the mean across a difference; the centre has the rest.
double side_weight(DerivativeFilter filter);

}  // namespace surf::volume
