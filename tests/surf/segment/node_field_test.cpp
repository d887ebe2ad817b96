#include "libsurf/segment/detail/node_field.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surf::segment {
namespace {

template <int Dim>
NodeGrid<Dim> skewed_grid() {
  NodeGrid<Dim> grid;
  for (int axis = 0; axis < Dim; ++axis) grid.size[axis] = 12 + axis;
  grid.node_to_world.setIdentity();
  grid.node_to_world.linear().diagonal().setConstant(0.5);
  grid.node_to_world.linear()(0, 1) = 0.1;
  grid.node_to_world.translation().setConstant(-1);
  return grid;
}

template <class T>
struct NodeFieldsOf : ::testing::Test {};
struct DimName {
  template <class T>
  static std::string GetName(int) {
    return "Dim" + std::to_string(T::value);
  }
};
using Dims = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(NodeFieldsOf, Dims, DimName);

TYPED_TEST(NodeFieldsOf, ReproduceLinearFunctionsAndTheirGradients) {
  constexpr int kDim = TypeParam::value;
  const NodeGrid<kDim> grid = skewed_grid<kDim>();
  const Vector<kDim> slope = Vector<kDim>::LinSpaced(kDim, 1, 2);
  const Eigen::VectorXd values = grid.positions(0, grid.n()) * slope;
  const std::vector<float> linear(values.begin(), values.end());
  const std::vector<float> constant(values.size(), 7);
  const NodeFields<kDim, 3> fields(grid, {constant, linear, linear});
  const Vector<kDim> x = grid.node_to_world * Vector<kDim>(Vector<kDim>::Constant(5.3));
  const auto samples = fields.sample(x, Derivatives::kSecond);
  EXPECT_NEAR(samples[0].value, 7, 1e-6);
  EXPECT_LT(samples[0].gradient.norm(), 1e-5);
  for (const int n : {1, 2}) {
    EXPECT_NEAR(samples[n].value, x.dot(slope), 1e-6);
    EXPECT_LT((samples[n].gradient - slope).norm(), 1e-5);
    EXPECT_LT(samples[n].hessian.norm(), 1e-4);
  }
}

TYPED_TEST(NodeFieldsOf, HaveTheDerivativesOfTheirValues) {
  constexpr int kDim = TypeParam::value;
  const NodeGrid<kDim> grid = skewed_grid<kDim>();
  std::vector<float> values(grid.n());
  for (std::size_t at = 0; at < values.size(); ++at) values[at] = float(std::sin(double(at)));
  const NodeFields<kDim, 1> field(grid, {values});
  constexpr double kStep = 1e-5;
  const Vector<kDim> x = grid.node_to_world * Vector<kDim>(Vector<kDim>::Constant(4.4));
  const auto at = field.sample(x, Derivatives::kSecond)[0];
  for (int axis = 0; axis < kDim; ++axis) {
    const Vector<kDim> step = kStep * Vector<kDim>::Unit(axis);
    const auto next = field.sample(x + step, Derivatives::kFirst)[0];
    const auto last = field.sample(x - step, Derivatives::kFirst)[0];
    EXPECT_NEAR(at.gradient[axis], (next.value - last.value) / (2 * kStep), 1e-6);
    EXPECT_LT((at.hessian.col(axis) - (next.gradient - last.gradient) / (2 * kStep)).norm(), 1e-4);
  }
}

TEST(Blur, KeepsASumAndHasTheDeviationThatIsAsked) {
  const std::array<int, 3> size = {81, 1, 1};
  std::vector<float> values(81, 0);
  values[40] = 1;
  blur(size, 4, values);
  double sum = 0, variance = 0;
  for (int i = 0; i < 81; ++i) {
    sum += values[i];
    variance += values[i] * (i - 40) * (i - 40);
  }
  EXPECT_NEAR(sum, 1, 1e-5);
  EXPECT_NEAR(std::sqrt(variance), 4, 0.5);  // boxes have whole radii
}

TEST(NodeField, BlurOfWantedNodesIsThatOfAll) {
  const std::array<int, 3> size = {37, 29, 41};
  std::vector<float> all(std::size_t(size[0]) * size[1] * size[2]);
  for (std::size_t at = 0; at < all.size(); ++at) all[at] = float(at * 7919 % 1009);
  const std::vector<float> before = all;
  blur(size, 4, all);
  for (const IndexBox<3>& wanted :
       {IndexBox<3>{{3, 5, 7}, {30, 20, 11}}, {{36, 28, 40}, {1, 1, 1}}, {{}, size}}) {
    std::vector<float> some = before;
    blur(size, 4, wanted, some);
    const IndexBox<3> grid{{}, size};
    for (std::size_t n = 0; n < wanted.n(); ++n)
      ASSERT_EQ(some[grid.at(wanted.node(n))], all[grid.at(wanted.node(n))]) << n;
  }
}

}  // namespace
}  // namespace surf::segment
