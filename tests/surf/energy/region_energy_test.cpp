// How the integrals of a region energy follow the shape; values and derivatives of its kinds are
// tested with these.
#include "libsurf/energy/region_energy.h"

#include "libsurf/energy/fields.h"
#include "tests/surf/fixtures.h"

namespace surf::energy {
namespace {

/// J = |Omega|^2: one integral, of 1.
template <int Dim>
class SquaredContent : public RegionEnergy<Dim> {
 public:
  SquaredContent()
      : RegionEnergy<Dim>(constant_field<Dim>(3),
                          [](const Eigen::VectorXd&, Eigen::MatrixXd& values) { values.setOnes(); },
                          1, {}) {}
  std::string name() const override { return "squared content"; }
  int n_scratch() const { return n_scratch_; }

 protected:
  Eigen::VectorXd integrals_over(const fem::Geometry<Dim>& shape) const override {
    ++n_scratch_;
    return RegionEnergy<Dim>::integrals_over(shape);
  }

 private:
  double value_of(const Eigen::VectorXd& p) const override { return p[0] * p[0]; }
  std::function<std::array<double, 2>(double)> density() const override {
    const double G = 2 * this->integrals()[0];
    return [G](double) { return std::array<double, 2>{G, 0}; };
  }
  Eigen::MatrixXd second_of_integrals() const override {
    return Eigen::MatrixXd::Constant(1, 1, 2);
  }

  mutable int n_scratch_ = 0;
};

IN_BOTH_DIMENSIONS(RegionEnergyOf);

constexpr double kRelative = 1e-10;  // sums over a thousand elements

TYPED_TEST(RegionEnergyOf, AMoveThatIsTriedChangesNothingUntilItIsAccepted) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(3);
  const auto larger = shape.moved_to(1.1 * shape.points());
  SquaredContent<Dim> J;
  J.reset(shape);
  const double before = J.value(), expected = std::pow(larger.enclosed(), 2);
  EXPECT_NEAR(before, std::pow(shape.enclosed(), 2), kRelative * before);
  EXPECT_NEAR(J.try_move(larger), expected, kRelative * expected);
  EXPECT_EQ(J.value(), before);
  J.try_move(shape.moved_to(0.9 * shape.points()));
  J.try_move(larger);  // the last one counts
  J.accept();
  EXPECT_NEAR(J.value(), expected, kRelative * expected);
}

TYPED_TEST(RegionEnergyOf, FollowsManyMovesByWhatTheySweepAlone) {
  constexpr int Dim = TypeParam::value;
  auto shape = test::sphere_geometry<Dim>(3);
  SquaredContent<Dim> J;
  J.reset(shape);
  for (int k = 0; k < 20; ++k) {
    Points<Dim> to = shape.points();
    to.col(0) *= 1.03;
    to.col(Dim - 1).array() += 0.1;
    shape = shape.moved_to(to);
    J.try_move(shape);
    J.accept();
  }
  const double expected = std::pow(shape.enclosed(), 2);
  EXPECT_EQ(J.n_scratch(), 1) << "at the reset";
  EXPECT_NEAR(J.value(), expected, 20 * kRelative * expected);
}

TYPED_TEST(RegionEnergyOf, ANewMeshChangesTheIntegralsByTheContent) {
  constexpr int Dim = TypeParam::value;
  const auto coarse = test::sphere_geometry<Dim>(2), fine = test::sphere_geometry<Dim>(3);
  SquaredContent<Dim> J;
  J.reset(coarse);
  const double before = J.value();
  J.remesh(fine);
  EXPECT_NEAR(J.value(), before, kRelative * before);
  EXPECT_NEAR(J.drift(), std::pow(fine.enclosed(), 2) - before, kRelative * before);
  EXPECT_EQ(J.n_scratch(), 1) << "at the reset";
  const auto larger = fine.moved_to(1.1 * fine.points());  // sweeps from the new mesh
  const double expected = std::pow(larger.enclosed(), 2);
  EXPECT_NEAR(J.try_move(larger) + J.drift(), expected, kRelative * expected);
}

TYPED_TEST(RegionEnergyOf, SurgeryIsFollowedByWhatItHasChanged) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(5);
  Points<Dim> X = shape.points();
  X.row(7) *= 0.8;
  const fem::Geometry<Dim> operated(X, shape.elements().colwise().reverse().eval());
  SquaredContent<Dim> J;
  J.reset(shape);
  const double before = J.value();
  J.rebuild(operated);
  EXPECT_EQ(J.n_scratch(), 1) << "at the reset";
  EXPECT_NEAR(J.integrals()[0], operated.enclosed(), kRelative * operated.enclosed());
  EXPECT_NEAR(J.value(), before, kRelative * before);
  J.rebuild(operated);  // the current one: anew
  EXPECT_EQ(J.n_scratch(), 2);
  J.rebuild(shape.moved_to(2 * shape.points()));  // all of it
  EXPECT_EQ(J.n_scratch(), 3);
}

TYPED_TEST(RegionEnergyOf, ItsDensityIsThatOfTheCurrentShape) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::sphere_geometry<Dim>(3);
  SquaredContent<Dim> J;
  J.reset(shape);
  Eigen::VectorXd density = Eigen::VectorXd::Constant(4, 0.5);
  J.add_density(Points<Dim>::Random(4, Dim), 2, density);
  for (const double value : density) EXPECT_NEAR(value, 0.5 + 4 * shape.enclosed(), 1e-9);
}

}  // namespace
}  // namespace surf::energy
