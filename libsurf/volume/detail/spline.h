// Weights of the cubic B-spline and of the Gaussian, for fields on grids of any dimension.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libsurf/base/field.h"
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

/// Four coefficients along the first axis.
using SplineRow = Eigen::Array4d;

/// A spline and its derivatives by the index at one point. The sums across the first axis are made
/// of whole rows at once, and only those that are asked for: values take half the time of sums of
/// single coefficients, first derivatives a quarter.
template <int Dim>
struct SplineSums {
  double value = 0;
  Vector<Dim> gradient;
  Eigen::Matrix<double, Dim, Dim> hessian;

  /// @param row_at  the row of coefficients with the nodes j of the second and k of the third axis
  template <class RowAt>
  SplineSums(const std::array<SplineWeights, Dim>& weights, Derivatives order,
             const RowAt& row_at) {
    const SplineRow x0 = row_of(weights[0].value);
    Rows rows = plane(weights[1], order, [&](int j) { return row_at(j, 0); });
    SplineRow z = SplineRow::Zero(), yz = SplineRow::Zero(), zz = SplineRow::Zero();
    if constexpr (Dim == 3) {
      Rows sum = times(rows, weights[2].value[0]);
      if (order != Derivatives::kNone) z = weights[2].first[0] * rows.value;
      if (order == Derivatives::kSecond) {
        yz = weights[2].first[0] * rows.y;
        zz = weights[2].second[0] * rows.value;
      }
      for (int k = 1; k < 4; ++k) {
        rows = plane(weights[1], order, [&](int j) { return row_at(j, k); });
        sum.value += weights[2].value[k] * rows.value;
        if (order == Derivatives::kNone) continue;
        sum.y += weights[2].value[k] * rows.y;
        z += weights[2].first[k] * rows.value;
        if (order == Derivatives::kFirst) continue;
        sum.yy += weights[2].value[k] * rows.yy;
        yz += weights[2].first[k] * rows.y;
        zz += weights[2].second[k] * rows.value;
      }
      rows = sum;
    }
    value = (x0 * rows.value).sum();
    if (order == Derivatives::kNone) return;
    const SplineRow x1 = row_of(weights[0].first);
    gradient[0] = (x1 * rows.value).sum();
    gradient[1] = (x0 * rows.y).sum();
    if constexpr (Dim == 3) gradient[2] = (x0 * z).sum();
    if (order == Derivatives::kFirst) return;
    hessian(0, 0) = (row_of(weights[0].second) * rows.value).sum();
    hessian(0, 1) = hessian(1, 0) = (x1 * rows.y).sum();
    hessian(1, 1) = (x0 * rows.yy).sum();
    if constexpr (Dim == 3) {
      hessian(0, 2) = hessian(2, 0) = (x1 * z).sum();
      hessian(1, 2) = hessian(2, 1) = (x0 * yz).sum();
      hessian(2, 2) = (x0 * zz).sum();
    }
  }

 private:
  struct Rows {
    SplineRow value = SplineRow::Zero(), y = SplineRow::Zero(), yy = SplineRow::Zero();
  };

  static SplineRow row_of(const std::array<double, 4>& weights) {
    return Eigen::Map<const SplineRow>(weights.data());
  }
  static Rows times(const Rows& rows, double factor) {
    return {factor * rows.value, factor * rows.y, factor * rows.yy};
  }
  template <class RowAt>
  static Rows plane(const SplineWeights& weights, Derivatives order, const RowAt& row_at) {
    Rows out;
    for (int j = 0; j < 4; ++j) {
      const SplineRow row = row_at(j);
      out.value += weights.value[j] * row;
      if (order == Derivatives::kNone) continue;
      out.y += weights.first[j] * row;
      if (order == Derivatives::kSecond) out.yy += weights.second[j] * row;
    }
    return out;
  }
};

/// Half of a symmetric kernel, centre first.
using Kernel = std::vector<double>;

/// Gaussian of this deviation [nodes], truncated at 3 sigma, sum of the whole kernel 1; {1} for 0.
Kernel gaussian_kernel(double sigma);

/// Weights of the selective Gaussian blur of this deviation [nodes], of radius 2 sigma; {1} for 0.
Kernel selective_kernel(double sigma);

/// Weight of each side in the mean across a difference; the centre has the rest.
double side_weight(DerivativeFilter filter);

}  // namespace surf::volume
