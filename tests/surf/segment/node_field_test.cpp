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
struct NodeFields : ::testing::Test {};
struct DimName {
  template <class T>
  static std::string GetName(int) {
    return "Dim" + std::to_string(T::value);
  }
};
using Dims = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(NodeFields, Dims, DimName);

TYPED_TEST(NodeFields, ReproduceLinearFunctionsAndTheirGradients) {
  constexpr int kDim = TypeParam::value;
  const NodeGrid<kDim> grid = skewed_grid<kDim>();
  const Vector<kDim> slope = Vector<kDim>::LinSpaced(kDim, 1, 2);
  const Eigen::VectorXd values = grid.positions() * slope;
  const NodeField<kDim> field(grid, {values.begin(), values.end()});
  Points<kDim> x(1, kDim);
  const Vector<kDim> node = Vector<kDim>::Constant(5.3);
  x.row(0) = (grid.node_to_world * node).transpose();
  Samples<kDim> samples;
  field.sample(x, Derivatives::kSecond, samples);
  EXPECT_NEAR(samples.value[0], x.row(0).dot(slope), 1e-6);
  EXPECT_LT((samples.gradient.row(0).transpose() - slope).norm(), 1e-5);
  EXPECT_LT(samples.hessian.row(0).norm(), 1e-4);
}

TYPED_TEST(NodeFields, HaveTheDerivativesOfTheirValues) {
  constexpr int kDim = TypeParam::value;
  const NodeGrid<kDim> grid = skewed_grid<kDim>();
  std::vector<float> values(grid.n());
  for (std::size_t at = 0; at < values.size(); ++at) values[at] = float(std::sin(double(at)));
  const NodeField<kDim> field(grid, values);
  constexpr double kStep = 1e-5;
  Points<kDim> x(2 * kDim + 1, kDim);
  x.rowwise() = (grid.node_to_world * Vector<kDim>(Vector<kDim>::Constant(4.4))).transpose().eval();
  for (int axis = 0; axis < kDim; ++axis) {
    x(1 + 2 * axis, axis) += kStep;
    x(2 + 2 * axis, axis) -= kStep;
  }
  Samples<kDim> s;
  field.sample(x, Derivatives::kSecond, s);
  for (int axis = 0; axis < kDim; ++axis) {
    EXPECT_NEAR(s.gradient(0, axis), (s.value[1 + 2 * axis] - s.value[2 + 2 * axis]) / (2 * kStep),
                1e-6);
    const auto second =
        ((s.gradient.row(1 + 2 * axis) - s.gradient.row(2 + 2 * axis)) / (2 * kStep)).eval();
    EXPECT_LT((s.hessian.row(0).segment(kDim * axis, kDim) - second).norm(), 1e-4);
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

}  // namespace
}  // namespace surf::segment
