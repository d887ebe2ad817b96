#include "libsurf/energy/domain_integrals.h"

#include <atomic>

#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

constexpr double kPi = std::numbers::pi;

void value_itself(const Eigen::VectorXd& value, Eigen::MatrixXd& out) { out.col(0) = value; }

/// F(x) = x_0^2.
template <int Dim>
class SquareField : public Field<Dim> {
 public:
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    out.value = x.col(0).cwiseAbs2();
    out.gradient.setZero();
    out.hessian.setZero();
    if (order >= Derivatives::kFirst) out.gradient.col(0) = 2 * x.col(0);
    if (order >= Derivatives::kSecond) out.hessian.col(0).setConstant(2);
  }
};

IN_BOTH_DIMENSIONS(Integrals);

// Constants are integrated exactly: two Gauss points per interval are exact for s^(Dim-1).
TYPED_TEST(Integrals, AbsoluteOfOneIsTheEnclosedContentExactly) {
  constexpr int Dim = TypeParam::value;
  const DomainIntegrals<Dim> integrals(1, 0.3, 1);
  const auto arrays = test::random_smooth_shape<Dim>(1, 3);
  const fem::Geometry<Dim> shape(arrays.X.array() + 7.0, arrays.T);
  const double content = integrals.absolute(*constant_field<Dim>(1), value_itself, shape)[0];
  EXPECT_NEAR(content, shape.enclosed(), 1e-13 * shape.enclosed());
}

// Polynomials of degree 2 on a polyhedron: order 3 on the elements and on the rays would be exact;
// the rays' two points per interval leave their error of fourth order.
TYPED_TEST(Integrals, AbsoluteOfASquareConvergesToTheSecondMomentOfTheBall) {
  constexpr int Dim = TypeParam::value;
  // int x^2 = pi/4 on the disc, 4 pi / 15 in the ball; shifted by c: + c^2 times the content.
  const double moment = Dim == 2 ? kPi / 4 : 4 * kPi / 15;
  const double content = Dim == 2 ? kPi : 4 * kPi / 3;
  constexpr double kShift = 2;
  const auto error = [&](int level) {
    auto arrays = test::unit_sphere<Dim>(level);
    arrays.X.col(0).array() += kShift;
    const DomainIntegrals<Dim> integrals(3, 0.1, 1);
    const double value = integrals.absolute(SquareField<Dim>(), value_itself,
                                            fem::Geometry<Dim>(arrays.X, arrays.T))[0];
    return std::abs(value - (moment + kShift * kShift * content));
  };
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.1);  // of the polyhedron
  EXPECT_LT(error(4), 0.01 * kShift * kShift * content);
}

/// Where it is looked at.
template <int Dim>
class CountedSquares : public SquareField<Dim> {
 public:
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    n += x.rows();
    SquareField<Dim>::sample(x, order, out);
  }
  mutable std::atomic<Eigen::Index> n = 0;
};

// Two places of a mesh are changed, whose elements and vertices come in another order.
TYPED_TEST(Integrals, BetweenTwoMeshesIsTheirDifferenceByWhatTheyDoNotShare) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(5);
  const fem::Geometry<Dim> from(arrays.X, arrays.T);
  Points<Dim> X = arrays.X;
  X.row(3) *= 0.9;
  X.row(X.rows() / 2) *= 1.05;
  const Points<Dim> turned = X.colwise().reverse();
  const Elements<Dim> T = (int(X.rows()) - 1 - arrays.T.array()).colwise().reverse();
  const fem::Geometry<Dim> to(turned, T);
  const DomainIntegrals<Dim> integrals(3, 0.02, 1);
  const CountedSquares<Dim> squares;
  const double all = integrals.absolute(squares, value_itself, to)[0] -
                     integrals.absolute(squares, value_itself, from)[0];
  const Eigen::Index n_all = squares.n;
  EXPECT_NEAR((*integrals.between(squares, value_itself, from, to))[0], all, 1e-7);
  EXPECT_LT(squares.n - n_all, n_all / 20);
  const auto one = constant_field<Dim>(1);
  EXPECT_NEAR((*integrals.between(*one, value_itself, from, to))[0],
              to.enclosed() - from.enclosed(), 1e-13);
  EXPECT_EQ((*integrals.between(*one, value_itself, to, to))[0], 0);
  Elements<Dim> inverted = arrays.T;  // the same places, but none of the same elements
  inverted.col(0).swap(inverted.col(1));
  EXPECT_FALSE(integrals.between(*one, value_itself, from, fem::Geometry<Dim>(arrays.X, inverted)));
  EXPECT_FALSE(integrals.between(*one, value_itself, from, from.moved_to(2 * from.points())));
}

// The torus is not star-shaped about its centre, which even lies outside it.
TEST(Integrals, AbsoluteOfATorusConvergesToItsVolumeAndMoment) {
  const double R = 1, r = 0.4;
  const double volume = 2 * kPi * kPi * R * r * r;
  const double moment = 0.5 * 2 * kPi * kPi * R * r * r * (R * R + 0.75 * r * r);  // int x^2
  Eigen::Array2d errors[2];
  for (int finer = 0; finer < 2; ++finer) {
    const auto arrays = test::torus(R, r, 32 << finer, 16 << finer);
    const fem::Geometry<3> shape(arrays.X, arrays.T);
    const DomainIntegrals<3> integrals(3, 0.1, 1);
    const double one = integrals.absolute(*constant_field<3>(1), value_itself, shape)[0];
    const double square = integrals.absolute(SquareField<3>(), value_itself, shape)[0];
    EXPECT_NEAR(one, shape.enclosed(), 1e-12 * volume);
    errors[finer] << std::abs(one - volume), std::abs(square - moment);
  }
  EXPECT_NEAR(std::log2(errors[0][0] / errors[1][0]), 2, 0.1);
  EXPECT_NEAR(std::log2(errors[0][1] / errors[1][1]), 2, 0.1);
  EXPECT_LT(errors[1][0], 0.02 * volume);
}

TYPED_TEST(Integrals, AbsoluteDoesNotDependOnTheFrameOfReference) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(2, Dim == 2 ? 5 : 4);
  const DomainIntegrals<Dim> integrals(3, 0.05, 1);
  const test::WaveField<Dim> F(1);
  // The same shape with its vertices renumbered has another first vertex, but the same integral.
  Points<Dim> X = arrays.X.colwise().reverse();
  const Elements<Dim> T = static_cast<int>(X.rows()) - 1 - arrays.T.array();
  const double a = integrals.absolute(F, value_itself, fem::Geometry<Dim>(arrays.X, arrays.T))[0];
  const double b = integrals.absolute(F, value_itself, fem::Geometry<Dim>(X, T))[0];
  EXPECT_NEAR(a, b, 1e-12 * std::abs(a));
}

TYPED_TEST(Integrals, SweptOfOneIsTheChangeOfTheEnclosedContentExactly) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(3, 3);
  const fem::Geometry<Dim> from(arrays.X, arrays.T);
  const auto to = from.moved_to(arrays.X + 0.3 * test::random_smooth_vectors<Dim>(arrays.X, 4));
  const DomainIntegrals<Dim> integrals(1, 1, 1);
  const double swept = integrals.swept(*constant_field<Dim>(1), value_itself, from, to)[0];
  EXPECT_NEAR(swept, to.enclosed() - from.enclosed(), 1e-13);
}

TYPED_TEST(Integrals, SweptIsTheDifferenceOfTheAbsoluteIntegrals) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::random_smooth_shape<Dim>(4, Dim == 2 ? 5 : 4);
  const fem::Geometry<Dim> from(arrays.X, arrays.T);
  const Points<Dim> W = test::random_smooth_vectors<Dim>(arrays.X, 5);
  const test::WaveField<Dim> F(2);
  const DomainIntegrals<Dim> integrals(5, 0.02, 1);
  const auto error = [&](double step) {
    const auto to = from.moved_to(arrays.X + step * W);
    const double difference =
        integrals.absolute(F, value_itself, to)[0] - integrals.absolute(F, value_itself, from)[0];
    EXPECT_GT(std::abs(difference), 0.01 * step);
    return std::abs(integrals.swept(F, value_itself, from, to)[0] - difference);
  };
  EXPECT_LT(error(0.1), 1e-5);
  EXPECT_LT(error(0.4), 1e-3);
}

TYPED_TEST(Integrals, OfSeveralIntegrandsAreThoseOfEach) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(5, 3);
  const test::WaveField<Dim> F(3);
  const auto both = [](const Eigen::VectorXd& value, Eigen::MatrixXd& out) {
    out.col(0).setOnes();
    out.col(1) = value;
  };
  const Eigen::VectorXd result = DomainIntegrals<Dim>(2, 0.1, 2).absolute(F, both, shape);
  const DomainIntegrals<Dim> single(2, 0.1, 1);
  EXPECT_NEAR(result[0], shape.enclosed(), 1e-13 * shape.enclosed());
  EXPECT_NEAR(result[1], single.absolute(F, value_itself, shape)[0], 1e-13);
}

}  // namespace
}  // namespace surf::energy
