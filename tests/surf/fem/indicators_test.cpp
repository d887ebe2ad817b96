#include "libsurf/fem/indicators.h"

#include "libsurf/fem/quadrature.h"
#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

IN_BOTH_DIMENSIONS(Indicators);

/// A polynomial of one coordinate.
template <int Dim>
class Power : public Field<Dim> {
 public:
  explicit Power(int exponent) : exponent_(exponent) {}
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    out.value = x.col(0).array().pow(exponent_);
  }

 private:
  int exponent_;
};

TYPED_TEST(Indicators, GeometricVariationIsExactOnTheOctagonAndTheOctahedron) {
  constexpr int Dim = TypeParam::value;
  const Eigen::VectorXd eta = geometric_variation(test::sphere_geometry<Dim>(0));
  const double pi = std::numbers::pi;
  const double expected =
      Dim == 2 ? 2 * (2 * std::sin(pi / 8)) * (pi / 4) : 3 * std::sqrt(2.0) * std::acos(1.0 / 3);
  EXPECT_LT((eta.array() - expected).abs().maxCoeff(), 1e-12);
}

TYPED_TEST(Indicators, GeometricVariationFallsWithTheSquareOfTheEdge) {
  constexpr int Dim = TypeParam::value;
  const double coarse = geometric_variation(test::sphere_geometry<Dim>(3)).maxCoeff();
  const double fine = geometric_variation(test::sphere_geometry<Dim>(4)).maxCoeff();
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.1);
}

TYPED_TEST(Indicators, GeometricVariationHasTheShapesUnitAndVanishesOnFlatParts) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::rough_sphere<Dim>(3);
  const Eigen::VectorXd eta = geometric_variation(Geometry<Dim>(arrays.X, arrays.T));
  const Eigen::VectorXd scaled = geometric_variation(Geometry<Dim>(7 * arrays.X, arrays.T));
  EXPECT_LT((scaled - 7 * eta).cwiseAbs().maxCoeff(), 1e-12);
  // The square and the cube of the maximum norm: flat but at edges.
  auto box = test::unit_sphere<Dim>(4);
  for (Eigen::Index i = 0; i < box.X.rows(); ++i)
    box.X.row(i) /= box.X.row(i).cwiseAbs().maxCoeff();
  EXPECT_LT(geometric_variation(Geometry<Dim>(box.X, box.T)).minCoeff(), 1e-12);
}

TYPED_TEST(Indicators, QuadratureErrorVanishesWhereTheLowerRuleIsExact) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(1);
  EXPECT_LT(quadrature_error(shape, Power<Dim>(2)).maxCoeff(), 1e-14);
  EXPECT_GT(quadrature_error(shape, Power<Dim>(4), 2, 4).maxCoeff(), 1e-5);
}

TYPED_TEST(Indicators, QuadratureErrorIsTheErrorOfTheIntegral) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(2);
  // x^4 is integrated exactly by the higher rule.
  const auto& rule = quadrature<Dim>(1);
  const Eigen::VectorXd eta = quadrature_error(shape, Power<Dim>(4), 1, 4);
  for (Eigen::Index t = 0; t < shape.n_elements(); t += 5) {
    double exact = 0;
    const auto& fine = quadrature<Dim>(5);
    Eigen::Matrix<double, Dim, 1> x0;
    for (int i = 0; i < Dim; ++i) x0[i] = shape.points()(shape.elements()(t, i), 0);
    for (Eigen::Index q = 0; q < fine.size(); ++q)
      exact += fine.weights[q] * std::pow(fine.points.row(q).dot(x0), 4);
    const double mid = std::pow(rule.points.row(0).dot(x0), 4);
    EXPECT_NEAR(eta[t], shape.measures()[t] * std::abs(exact - mid), 1e-14);
  }
}

std::vector<Mark> geometry_marks(std::vector<double> eta, double tolerance) {
  return mark_geometry(Eigen::Map<Eigen::VectorXd>(eta.data(), eta.size()),
                       {.tolerance = tolerance});
}

constexpr Mark kC = Mark::kCoarsen, kK = Mark::kKeep, kR = Mark::kRefine;

TEST(Marks, OfTheGeometryRefineWhatIsAboveTheToleranceOrNearTheLargest) {
  EXPECT_EQ(geometry_marks({0.1, 0.5, 0.9, 1.2}, 1), (std::vector{kC, kK, kR, kR}));
  EXPECT_EQ(geometry_marks({0.1, 0.5, 1.1, 9.0}, 1), (std::vector{kC, kK, kR, kR}));
}

TEST(Marks, OfTheGeometryRefineNothingWithinTheTolerance) {
  EXPECT_EQ(geometry_marks({0.1, 0.29, 0.31, 1.0}, 1), (std::vector{kC, kC, kK, kK}));
}

TEST(Marks, OfIntegralsRefineElementsAboveTheirShare) {
  const Eigen::Vector4d measures(1, 1, 1, 1);
  const MarkingOptions options{.tolerance = 4};
  EXPECT_EQ(mark_integral(Eigen::Vector4d(0.2, 0.9, 1.1, 3), measures, options),
            (std::vector{kC, kK, kR, kR}));
  EXPECT_EQ(mark_integral(Eigen::Vector4d(0.2, 0.9, 1.1, 1.5), measures, options),
            (std::vector{kC, kK, kK, kK}));  // they add up to less than the tolerance
}

TEST(Marks, OfFunctionsRefineTheLargest) {
  const Eigen::Vector4d measures(1, 1, 1, 1);
  EXPECT_EQ(mark_function(Eigen::Vector4d(0.2, 1.5, 2, 3), measures, {.tolerance = 4}),
            (std::vector{kC, kK, kK, kR}));
}

TEST(Marks, TogetherRefineIfAnySaysSoAndCoarsenIfAllDo) {
  std::vector<Mark> marks = {kC, kC, kC, kK, kR};
  combine(marks, {kC, kK, kR, kC, kC});
  EXPECT_EQ(marks, (std::vector{kC, kK, kR, kK, kR}));
}

}  // namespace
}  // namespace surf::fem
