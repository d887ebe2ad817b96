#include "libcurve/energy/solution_response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libcurve/mesh/mesh_motion.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/random.h"
#include "libsurf/fem/geometry.h"
#include "tests/curve/analytic_fields.h"

namespace surf::curve {
namespace {

constexpr NeumannOptions kOptions{.mu = 0.1, .spacing_mm = 0.03, .tolerance = 1e-13};

Neumann solved(const Segments& curves, double h) {
  DomainMesh mesh = mesh_domain(curves, square(2), SizeField(square(2), h, 0.1));
  ImageIntegrals integrals = image_integrals(mesh, *bright_waves(), kOptions);
  return {std::move(mesh), std::move(integrals), bright_waves(), kOptions};
}

/// Nodes that no motion of the curves moves.
std::vector<int> far_nodes(const MeshMotion& motion) {
  const std::vector<char> is_moving = motion.moving();
  std::vector<int> out;
  for (std::size_t i = 0; i < is_moving.size(); ++i)
    if (!is_moving[i]) out.push_back(int(i));
  return out;
}

/// |u'_W - difference quotient of u| / |u'_W| at the nodes that stay where they are.
double error_of_derivative(double h) {
  constexpr double kStep = 1e-4;  // truncation ~ kStep^2
  const Segments curves = circle({0.1, 0}, 0.9, h);
  const Neumann solution = solved(curves, h);
  const fem::Geometry<2> shape(curves.points, curves.elements);
  Eigen::VectorXd W(curves.points.rows());
  for (Eigen::Index i = 0; i < W.size(); ++i) W[i] = 1 + 0.5 * curves.points(i, 0);
  const MeshMotion motion(solution.mesh(), curves.elements, curves.points.rows());
  const Points<2> V = W.asDiagonal() * shape.nodal_normals();
  const Neumann plus = solution.moved_to(motion.moved(kStep * V)),
                minus = solution.moved_to(motion.moved(-kStep * V));
  const Eigen::VectorXd exact =
      SolutionResponse(solution, curves.elements, curves.points.rows()).derivative(W);
  double error = 0, scale = 0;
  for (const int node : far_nodes(motion))
    for (int side = 0; side < 2; ++side) {
      const int at = solution.unknowns().of_node(node, side);
      if (at < 0) continue;
      error += std::pow(exact[at] - (plus.u()[at] - minus.u()[at]) / (2 * kStep), 2);
      scale += std::pow(exact[at], 2);
    }
  return std::sqrt(error / scale);
}

TEST(SolutionResponse, ConvergesToTheDifferenceQuotientOfTheSolutions) {
  const double coarse = error_of_derivative(0.08), fine = error_of_derivative(0.04);
  EXPECT_LT(fine, 0.02);
  EXPECT_LT(fine, 0.5 * coarse);
}

TEST(SolutionResponse, IsSymmetricAndTakesFromTheSecondDerivative) {
  const Segments curves = circle({0.1, 0}, 0.9, 0.1);
  const SolutionResponse response(solved(curves, 0.1), curves.elements, curves.points.rows());
  for (const std::uint64_t seed : {1, 2, 3}) {
    Eigen::VectorXd V(curves.points.rows()), W(V.size());
    for (Eigen::Index i = 0; i < V.size(); ++i) {
      V[i] = 2 * uniform_random(seed, 2 * i) - 1;
      W[i] = 2 * uniform_random(seed, 2 * i + 1) - 1;
    }
    EXPECT_NEAR(V.dot(response(W)), W.dot(response(V)), 1e-12 * V.norm() * W.norm());
    EXPECT_LT(V.dot(response(V)), 0);
  }
}

}  // namespace
}  // namespace surf::curve
