#include "libsurf/energy/anisotropic_density.h"

#include "tests/surf/energy/energies.h"

namespace surf::energy {
namespace {

IN_BOTH_DIMENSIONS(Density);

template <int Dim>
std::map<std::string, DensityPointer<Dim>> every_density() {
  const auto f = std::make_shared<const test::WaveField<Dim>>(1);
  const Vector<Dim> metric = Vector<Dim>::LinSpaced(0.5, 2);
  constexpr double kThirdStep = 1e-4;
  return {{"isotropic", isotropic_density<Dim>(f)},
          {"scaled", scaled_density<Dim>(std::make_shared<const test::UserDensity<Dim>>(f), -3)},
          {"norm", norm_density<Dim>(f, metric.asDiagonal())},
          {"signed", alignment_density<Dim>(f, signed_alignment(-1, 2), kThirdStep)},
          {"absolute", alignment_density<Dim>(f, absolute_alignment(2, 0.3), kThirdStep)},
          {"user", std::make_shared<const test::UserDensity<Dim>>(f)}};
}

template <int Dim>
DensitySamples<Dim> sampled(const AnisotropicDensity<Dim>& H, const Points<Dim>& x,
                            const Points<Dim>& y, Derivatives order) {
  DensitySamples<Dim> out;
  H.sample(x, y, order, out);
  return out;
}

TYPED_TEST(Density, DerivativesAreDifferencesOfTheValue) {
  constexpr int Dim = TypeParam::value;
  constexpr double kStep = 1e-5, kTolerance = 1e-6;  // kStep^2 and rounding / kStep
  const Points<Dim> x = test::rough_sphere<Dim>(3, 1).X;
  const Points<Dim> y = test::unit_sphere<Dim>(1).X;
  for (const auto& [name, H] : every_density<Dim>()) {
    const auto at = sampled<Dim>(*H, x, y, Derivatives::kSecond);
    for (int axis = 0; axis < Dim; ++axis) {
      Points<Dim> move = Points<Dim>::Zero(x.rows(), Dim);
      move.col(axis).setConstant(kStep);
      const auto x_plus = sampled<Dim>(*H, x + move, y, Derivatives::kFirst);
      const auto x_minus = sampled<Dim>(*H, x - move, y, Derivatives::kFirst);
      const auto y_plus = sampled<Dim>(*H, x, y + move, Derivatives::kFirst);
      const auto y_minus = sampled<Dim>(*H, x, y - move, Derivatives::kFirst);
      const auto expect_near = [&, name = name](const auto& exact, const auto& plus,
                                                const auto& minus, const char* what) {
        EXPECT_LT((exact - (plus - minus) / (2 * kStep)).cwiseAbs().maxCoeff(), kTolerance)
            << name << ": " << what << ", axis " << axis;
      };
      expect_near(at.dx.col(axis), x_plus.value, x_minus.value, "H_x");
      expect_near(at.dy.col(axis), y_plus.value, y_minus.value, "H_y");
      // Rows of H_xx and H_xy: derivatives by x_axis of H_x and of H_y.
      expect_near(at.dxx.middleCols(axis * Dim, Dim), x_plus.dx, x_minus.dx, "H_xx");
      expect_near(at.dxy.middleCols(axis * Dim, Dim), x_plus.dy, x_minus.dy, "H_xy");
      expect_near(at.dyy.middleCols(axis * Dim, Dim), y_plus.dy, y_minus.dy, "H_yy");
    }
  }
}

TYPED_TEST(Density, SamplesNoMoreThanIsAskedFor) {
  constexpr int Dim = TypeParam::value;
  const Points<Dim> x = test::unit_sphere<Dim>(1).X;
  for (const auto& [name, H] : every_density<Dim>()) {
    const auto none = sampled<Dim>(*H, x, x, Derivatives::kNone);
    const auto first = sampled<Dim>(*H, x, x, Derivatives::kFirst);
    EXPECT_EQ(none.value, first.value) << name;
    EXPECT_EQ(none.dx.size(), 0) << name;
    EXPECT_EQ(first.dxx.size(), 0) << name;
    EXPECT_EQ(first.dy.rows(), x.rows()) << name;
  }
}

TEST(Alignment, IsSmallestAtTheRimOfBrightDarkOrBothKindsOfObjects) {
  constexpr double kSlope = 4, kScale = 2;
  EXPECT_EQ(signed_alignment(1, kScale)(-kSlope)[0], -2);  // I falls along the normal
  EXPECT_EQ(signed_alignment(-1, kScale)(kSlope)[0], -2);  // I rises
  EXPECT_NEAR(absolute_alignment(kScale, 0.01)(kSlope)[0], -2, 1e-4);
  EXPECT_NEAR(absolute_alignment(kScale, 0.01)(-kSlope)[0], -2, 1e-4);
  EXPECT_EQ(absolute_alignment(kScale, 0.01)(0)[0], -0.01);
}

}  // namespace
}  // namespace surf::energy
