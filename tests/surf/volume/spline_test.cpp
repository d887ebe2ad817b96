#include "libsurf/volume/detail/spline.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace surf::volume {
namespace {

struct Rows {
  const float* coefficients;
  SURF_INLINE SplineRow operator()(int j, int k) const {
    return row_of(coefficients + 16 * k + 4 * j);
  }
};

using Sums = std::array<double, 13>;

SURF_INLINE Sums sums_at(const Vector<3>& t, const float* coefficients) {
  const SplineSums<3> sums({SplineWeights(t[0]), SplineWeights(t[1]), SplineWeights(t[2])},
                           Derivatives::kSecond, Rows{coefficients});
  Sums out;
  out[0] = sums.value;
  for (int i = 0; i < 3; ++i) out[std::size_t(1 + i)] = sums.gradient[i];
  for (int i = 0; i < 9; ++i) out[std::size_t(4 + i)] = sums.hessian.data()[i];
  return out;
}

Sums plainly(const Vector<3>& t, const float* coefficients) { return sums_at(t, coefficients); }
SURF_AVX2 Sums by_avx2(const Vector<3>& t, const float* coefficients) {
  return sums_at(t, coefficients);
}

TEST(Spline, Avx2GivesTheSameBits) {
  if (!has_avx2()) GTEST_SKIP() << "this processor has no AVX2";
  std::mt19937 random(5);
  std::normal_distribution<float> value(100, 50);
  std::uniform_real_distribution<double> fraction(0, 1);
  for (int repeat = 0; repeat < 100; ++repeat) {
    std::array<float, 64> coefficients;
    for (float& c : coefficients) c = value(random);
    const Vector<3> t(fraction(random), fraction(random), fraction(random));
    const Sums one = plainly(t, coefficients.data()), other = by_avx2(t, coefficients.data());
    for (std::size_t n = 0; n < one.size(); ++n)
      EXPECT_EQ(std::bit_cast<std::uint64_t>(one[n]), std::bit_cast<std::uint64_t>(other[n])) << n;
  }
}

TEST(Spline, WeightsSumToOneAndTheirDerivativesToNothing) {
  const SplineWeights w(0.3), values(0.3, Derivatives::kNone);
  EXPECT_NEAR(w.value[0] + w.value[1] + w.value[2] + w.value[3], 1, 1e-15);
  EXPECT_NEAR(w.first[0] + w.first[1] + w.first[2] + w.first[3], 0, 1e-15);
  EXPECT_NEAR(w.second[0] + w.second[1] + w.second[2] + w.second[3], 0, 1e-15);
  EXPECT_EQ(values.value, w.value);
  EXPECT_EQ(values.first, (std::array<double, 4>{}));
}

}  // namespace
}  // namespace surf::volume
