// Weights of the cubic B-spline and of the Gaussian, for fields on grids of any dimension.
#pragma once

// Rows of four doubles never cross a call: all that takes or gives them is inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

#include <Eigen/Core>
#include <array>
#include <cstring>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/volume/image_fields.h"

namespace surf::volume {

// Sampling is compiled twice, plainly and for AVX2, and the processor chooses: SURF_INLINE is for
// all that it is made of, SURF_AVX2 for the function round it. Without fused multiply-adds both
// give the same bits.
#define SURF_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__)
#define SURF_AVX2 __attribute__((target("avx2")))
inline bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2");
  return has;
}
#else
#define SURF_AVX2
inline bool has_avx2() { return false; }
#endif

/// Cubic B-spline weights of the four nodes round u = base + t, and as many of their derivatives as
/// are asked for; the others are 0.
struct SplineWeights {
  std::array<double, 4> value{}, first{}, second{};

  SURF_INLINE explicit SplineWeights(double t, Derivatives order = Derivatives::kSecond) {
    const double s = 1 - t;
    value = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
             (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
    if (order == Derivatives::kNone) return;
    first = {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
    if (order == Derivatives::kFirst) return;
    second = {s, 3 * t - 2, 3 * s - 2, t};
  }
};

inline double dot(const std::array<double, 4>& w, const float* c) {
  return w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
}

/// Four values along the first axis.
typedef double SplineRow __attribute__((vector_size(32)));

SURF_INLINE SplineRow row_of(const float* coefficients) {
  typedef float Floats __attribute__((vector_size(16)));
  Floats four;
  std::memcpy(&four, coefficients, sizeof(four));
  return __builtin_convertvector(four, SplineRow);
}

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
  SURF_INLINE SplineSums(const std::array<SplineWeights, Dim>& weights, Derivatives order,
                         const RowAt& row_at) {
    const SplineRow x0 = row_of(weights[0].value);
    Rows rows = plane(weights[1], order, 0, row_at);
    SplineRow z{}, yz{}, zz{};
    if constexpr (Dim == 3) {
      Rows sum = times(rows, weights[2].value[0]);
      if (order != Derivatives::kNone) z = weights[2].first[0] * rows.value;
      if (order == Derivatives::kSecond) {
        yz = weights[2].first[0] * rows.y;
        zz = weights[2].second[0] * rows.value;
      }
      for (int k = 1; k < 4; ++k) {
        rows = plane(weights[1], order, k, row_at);
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
    value = sum_of(x0 * rows.value);
    if (order == Derivatives::kNone) return;
    const SplineRow x1 = row_of(weights[0].first);
    gradient[0] = sum_of(x1 * rows.value);
    gradient[1] = sum_of(x0 * rows.y);
    if constexpr (Dim == 3) gradient[2] = sum_of(x0 * z);
    if (order == Derivatives::kFirst) return;
    hessian(0, 0) = sum_of(row_of(weights[0].second) * rows.value);
    hessian(0, 1) = hessian(1, 0) = sum_of(x1 * rows.y);
    hessian(1, 1) = sum_of(x0 * rows.yy);
    if constexpr (Dim == 3) {
      hessian(0, 2) = hessian(2, 0) = sum_of(x1 * z);
      hessian(1, 2) = hessian(2, 1) = sum_of(x0 * yz);
      hessian(2, 2) = sum_of(x0 * zz);
    }
  }

 private:
  struct Rows {
    SplineRow value{}, y{}, yy{};
  };

  SURF_INLINE static SplineRow row_of(const std::array<double, 4>& weights) {
    SplineRow out;
    std::memcpy(&out, weights.data(), sizeof(out));
    return out;
  }
  SURF_INLINE static double sum_of(const SplineRow& row) {
    return (row[0] + row[2]) + (row[1] + row[3]);
  }
  SURF_INLINE static Rows times(const Rows& rows, double factor) {
    return {factor * rows.value, factor * rows.y, factor * rows.yy};
  }
  template <class RowAt>
  SURF_INLINE static Rows plane(const SplineWeights& weights, Derivatives order, int k,
                                const RowAt& row_at) {
    Rows out;
    for (int j = 0; j < 4; ++j) {
      const SplineRow row = row_at(j, k);
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
