#include "libsurf/energy/chan_vese.h"

#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

/// 1 inside the sphere of radius 0.8 about the origin and 3 outside, with a smooth step between.
template <int Dim>
class Step : public Field<Dim> {
 public:
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    constexpr double kWidth = 0.02;
    out.resize(x.rows(), order);
    out.gradient.setZero();
    out.hessian.setZero();
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const double r = x.row(i).norm(), t = std::tanh((r - 0.8) / kWidth);
      out.value[i] = 2 + t;
      if (order >= Derivatives::kFirst && r > 0)
        out.gradient.row(i) = (1 - t * t) / kWidth / r * x.row(i);
    }
  }
};

/// |B_r| of the ball or disc.
template <int Dim>
double content(double r) {
  return Dim == 2 ? std::numbers::pi * r * r : 4 * std::numbers::pi / 3 * r * r * r;
}

/// Totals over the cube of side 4.
template <int Dim>
ImageTotals totals() {
  const double cube = std::pow(4, Dim), inner = content<Dim>(0.8);
  return {cube, 3 * cube - 2 * inner, 9 * cube - 8 * inner};
}

template <int Dim>
ChanVese<Dim> energy_of_ball(double radius, double scale = 1) {
  auto arrays = test::unit_sphere<Dim>(Dim == 2 ? 5 : 4);
  arrays.X *= radius;
  ChanVese<Dim> J(std::make_shared<const Step<Dim>>(), totals<Dim>(),
                  {.ray_spacing_mm = 0.01, .intensity_scale = scale});
  J.reset({arrays.X, arrays.T});
  return J;
}

IN_BOTH_DIMENSIONS(TwoRegions);

TYPED_TEST(TwoRegions, MeansAreThoseOfBothSides) {
  constexpr int Dim = TypeParam::value;
  constexpr double kTolerance = 0.02;  // of the polyhedron in place of the ball
  for (const double radius : {0.5, 1.2}) {
    const double V = content<Dim>(radius), inner = content<Dim>(std::min(radius, 0.8));
    const double outer = totals<Dim>().content - V;
    const auto [inside, outside] = energy_of_ball<Dim>(radius).means();
    EXPECT_NEAR(inside, (inner + 3 * (V - inner)) / V, kTolerance) << radius;
    EXPECT_NEAR(outside, 3 - 2 * (content<Dim>(0.8) - inner) / outer, kTolerance) << radius;
  }
}

/// P of the intensity 2 where the shape is, behind waves of 5 cells across the lines that it is
/// summed along.
template <int Dim>
class BehindWaves : public Field<Dim> {
 public:
  static constexpr double kCell = 0.05, kAlong = 0.4;

  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    const auto waves = (2 * std::numbers::pi / (5 * kCell) * x.col(1).array() + 0.3).sin();
    out.value = (2 * x.col(0).array() + 40 * waves) / kAlong;
  }
};

TYPED_TEST(TwoRegions, TheMeanInsideIsFreeOfWhatLiesElsewhereHoweverLongTheElements) {
  constexpr int Dim = TypeParam::value;
  Vector<Dim> direction = Vector<Dim>::Zero();
  direction[0] = BehindWaves<Dim>::kAlong;
  for (const int level : {1, 2, 3}) {
    auto arrays = test::unit_sphere<Dim>(Dim == 2 ? level + 2 : level);
    Eigen::Matrix<double, Dim, Dim> turn = Eigen::Matrix<double, Dim, Dim>::Identity();
    turn.template topLeftCorner<2, 2>() = Eigen::Rotation2Dd(0.4).toRotationMatrix();
    arrays.X = arrays.X * turn;
    ChanVese<Dim> J(std::make_shared<const Step<Dim>>(), totals<Dim>(), {},
                    Antiderivative<Dim>{direction, std::make_shared<const BehindWaves<Dim>>(),
                                        BehindWaves<Dim>::kCell});
    J.reset({arrays.X, arrays.T});
    EXPECT_NEAR(J.means()[0], 2, 0.05) << level;
  }
}

TYPED_TEST(TwoRegions, EnergyAlmostVanishesOnTheTrueBoundaryAndRisesOnBothSides) {
  constexpr int Dim = TypeParam::value;
  const double at = energy_of_ball<Dim>(0.8).value();
  const double below = energy_of_ball<Dim>(0.7).value(), above = energy_of_ball<Dim>(0.9).value();
  // The totals are those of a sharp step; its width of 0.02 leaves about |Gamma| * 0.04 of J.
  EXPECT_LT(std::abs(at), 0.2 * below);
  EXPECT_LT(std::abs(at), 0.2 * above);
}

// Steps grow the ball, mending takes that back: without it the means drifted.
TYPED_TEST(TwoRegions, MeansStayThroughStepsThatMendingTakesBack) {
  constexpr int Dim = TypeParam::value;
  auto arrays = test::unit_sphere<Dim>(3);
  arrays.X *= 0.6;
  const fem::Geometry<Dim> shape(arrays.X, arrays.T);
  ChanVese<Dim> J(std::make_shared<const Step<Dim>>(), totals<Dim>(), {.ray_spacing_mm = 0.02});
  J.reset(shape);
  const auto means = J.means();
  const double before = J.value();
  for (int k = 0; k < 100; ++k) {
    J.try_move(shape.moved_to(1.02 * shape.points()));
    J.accept();
    J.remesh(shape);
  }
  EXPECT_NEAR(J.means()[0], means[0], 1e-6);
  EXPECT_NEAR(J.means()[1], means[1], 1e-6);
  EXPECT_NEAR(J.value() + J.drift(), before, 1e-6 * before);
}

TYPED_TEST(TwoRegions, EnergyIsDividedByTheSquaredIntensityScale) {
  constexpr int Dim = TypeParam::value;
  const double plain = energy_of_ball<Dim>(0.6).value();
  EXPECT_NEAR(energy_of_ball<Dim>(0.6, 5).value(), plain / 25, 1e-12 * plain);
}

// G = (I - mu_1)^2 - (I - mu_2)^2: a surface inside the object grows, one outside shrinks.
TYPED_TEST(TwoRegions, DerivativePushesTheSurfaceToTheBoundaryFromBothSides) {
  constexpr int Dim = TypeParam::value;
  for (const double radius : {0.5, 1.2}) {
    auto arrays = test::unit_sphere<Dim>(3);
    arrays.X *= radius;
    const fem::Geometry<Dim> shape(arrays.X, arrays.T);
    ChanVese<Dim> J(std::make_shared<const Step<Dim>>(), totals<Dim>(), {.ray_spacing_mm = 0.02});
    J.reset(shape);
    ShapeTerms<Dim> terms(shape);
    J.differentiate(test::no_curvature(shape.n_vertices()), 1, terms);
    const auto [inside, outside] = J.means();
    const double I = radius < 0.8 ? 1 : 3;
    const double G = (I - inside) * (I - inside) - (I - outside) * (I - outside);
    const Eigen::VectorXd normal_part = terms.derivative.cwiseProduct(shape.nodal_normals())
                                            .rowwise()
                                            .sum()
                                            .cwiseQuotient(shape.lumped_mass());
    EXPECT_EQ(G > 0, radius > 0.8);
    EXPECT_NEAR(normal_part.mean(), G, 0.03 * std::abs(G));
  }
}

}  // namespace
}  // namespace surf::energy
