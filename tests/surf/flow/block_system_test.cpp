// The semi-implicit system (3.54) as a whole, against its Schur complement (3.61).
#include <Eigen/LU>
#include <array>

#include "libsurf/fem/mass.h"
#include "tests/surf/flow/stepping.h"

namespace surf::flow {
namespace {

IN_BOTH_DIMENSIONS(BlockSystem);

/// Matrices of 3.5 and the load f, dense.
template <int Dim>
struct Blocks {
  Eigen::MatrixXd M, M_g;
  std::array<Eigen::MatrixXd, Dim> N;  // by components of the normal
  Eigen::MatrixXd A;
  Eigen::MatrixXd product;  // A_alpha + M_beta
  Eigen::VectorXd f;
};

/// (3.54) in the order of (3.56): unknowns and their rows are V_vec and K, which (3.58) eliminates,
/// then K_vec and V. Vectors are stored component by component.
template <int Dim>
struct Solution {
  Points<Dim> vector;
  Eigen::VectorXd K;
  Points<Dim> K_vector;
  Eigen::VectorXd V;

  Solution(const Blocks<Dim>& b, const Points<Dim>& X, double tau) {
    const Eigen::Index n = X.rows(), at_K = Dim * n, at_K_vector = at_K + n,
                       at_V = at_K_vector + Dim * n;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(at_V + n, at_V + n);
    Eigen::VectorXd load = Eigen::VectorXd::Zero(at_V + n);
    for (int d = 0; d < Dim; ++d) {
      const Eigen::Index velocity = d * n, curvature = at_K_vector + d * n;
      matrix.block(velocity, velocity, n, n) = b.M;
      matrix.block(velocity, at_V, n, n) = -b.N[d];
      matrix.block(at_K, curvature, n, n) = -b.N[d].transpose();
      matrix.block(curvature, velocity, n, n) = -tau * b.A;
      matrix.block(curvature, curvature, n, n) = b.M;
      load.segment(curvature, n) = b.A * X.col(d);
    }
    matrix.block(at_K, at_K, n, n) = b.M;
    matrix.block(at_V, at_K, n, n) = b.M_g;
    matrix.block(at_V, at_V, n, n) = b.product;
    load.tail(n) = -b.f;
    const Eigen::VectorXd x = matrix.partialPivLu().solve(load);
    vector = x.head(Dim * n).reshaped(n, Dim);
    K = x.segment(at_K, n);
    K_vector = x.segment(at_K_vector, Dim * n).reshaped(n, Dim);
    V = x.tail(n);
  }
};

/// What VelocitySystem has in place of the right-hand side of (3.61) is the exact derivative r. So
/// f = r - M_g K with the curvature K of the shape before the step.
template <int Dim>
Blocks<Dim> with_load(Blocks<Dim> blocks, const fem::Geometry<Dim>& shape,
                      const Eigen::VectorXd& r) {
  const Eigen::VectorXd K = Solution<Dim>(blocks, shape.points(), 0).K;
  blocks.f = r - blocks.M_g * K;
  return blocks;
}

template <int Dim>
Eigen::VectorXd beta_of(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                        ScalarProduct product) {
  if (product == ScalarProduct::kL2) return Eigen::VectorXd::Ones(shape.n_vertices());
  return terms.beta.cwiseMax(100 * terms.g.maxCoeff() / (shape.radius() * shape.radius()));
}

/// A and A_alpha, which both kinds of masses share.
template <int Dim>
Blocks<Dim> stiffness_blocks(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                             ScalarProduct product) {
  Blocks<Dim> out;
  out.A = fem::stiffness<Dim>(shape).toDense();
  out.product = product == ScalarProduct::kH1
                    ? fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0)).toDense()
                    : Eigen::MatrixXd::Zero(shape.n_vertices(), shape.n_vertices());
  out.f = Eigen::VectorXd::Zero(shape.n_vertices());
  return out;
}

template <int Dim>
Blocks<Dim> lumped_blocks(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                          ScalarProduct product) {
  Blocks<Dim> out = stiffness_blocks<Dim>(shape, terms, product);
  // <phi_i, 1> and <phi_i, nu>, element by element.
  Eigen::VectorXd m = Eigen::VectorXd::Zero(shape.n_vertices());
  Points<Dim> normals = Points<Dim>::Zero(shape.n_vertices(), Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    for (const int i : shape.elements().row(t)) {
      m[i] += shape.measures()[t] / Dim;
      normals.row(i) += shape.measures()[t] / Dim * shape.normals().row(t);
    }
  out.M = m.asDiagonal();
  out.M_g = m.cwiseProduct(terms.g).asDiagonal();
  out.product.diagonal() += m.cwiseProduct(beta_of<Dim>(shape, terms, product));
  for (int d = 0; d < Dim; ++d) out.N[d] = normals.col(d).asDiagonal();
  return out;
}

template <int Dim>
Blocks<Dim> consistent_blocks(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                              ScalarProduct product) {
  Blocks<Dim> out = stiffness_blocks<Dim>(shape, terms, product);
  out.M = fem::mass<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements())).toDense();
  out.M_g = fem::mass_nodal_weight<Dim>(shape, terms.g).toDense();
  out.product += fem::mass_nodal_weight<Dim>(shape, beta_of<Dim>(shape, terms, product)).toDense();
  for (int d = 0; d < Dim; ++d) out.N[d] = fem::mass<Dim>(shape, shape.normals().col(d)).toDense();
  return out;
}

template <int Dim>
energy::EnergySum<Dim> weighted_surface(unsigned seed) {
  energy::EnergySum<Dim> J;
  energy::add_minimal_surface<Dim>(J, std::make_shared<const test::WaveField<Dim>>(seed), 0.7, -1.3,
                                   {.ray_spacing_mm = 0.1});
  return J;
}

constexpr std::array kProducts = {ScalarProduct::kL2, ScalarProduct::kH1};

TYPED_TEST(BlockSystem, HasTheVelocityOfItsSchurComplement) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::smooth_geometry<Dim>(21, Dim == 2 ? 3 : 2);
  auto J = weighted_surface<Dim>(20);
  constexpr double kTolerance = 1e-10;  // of the iterative solver on surfaces, 1e-14, and of LU
  for (const ScalarProduct product : kProducts) {
    const test::Direction<Dim> direction(
        shape, J, {.product = product, .scheme = Scheme::kSemiImplicit, .solver_tolerance = 1e-14});
    const auto& terms = direction.terms;
    ASSERT_GT(terms.g.maxCoeff(), 1.2 * terms.g.minCoeff());
    const Eigen::VectorXd r = terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const Blocks<Dim> blocks = with_load<Dim>(lumped_blocks<Dim>(shape, terms, product), shape, r);
    for (const double tau : {1e-3, 0.02, 0.5}) {
      const Solution<Dim> block(blocks, shape.points(), tau);
      const Velocity<Dim> schur = direction.system.solve(tau);
      EXPECT_LT((schur.normal - block.V).norm(), kTolerance * block.V.norm()) << tau;
      EXPECT_LT((schur.vector - block.vector).norm(), kTolerance * block.vector.norm()) << tau;
      // K is the curvature after the step (3.43), (3.44), with the normals before it.
      const Points<Dim> moved = shape.points() + tau * schur.vector;
      const Eigen::VectorXd K = (shape.nodal_normals().cwiseProduct(direction.A * moved))
                                    .rowwise()
                                    .sum()
                                    .cwiseQuotient(shape.lumped_mass());
      EXPECT_LT((K - block.K).norm(), 1e2 * kTolerance * block.K.norm()) << tau;
    }
  }
}

// As printed, masses are consistent. Lumping changes V by the square of the edges' length.
TEST(BlockSystem, WithConsistentMassesDiffersBySecondOrder) {
  for (const ScalarProduct product : kProducts) {
    std::array<double, 3> difference;
    for (int level = 0; level < 3; ++level) {
      const auto shape = test::smooth_geometry<2>(22, level + 2);
      auto J = weighted_surface<2>(21);
      const test::Direction<2> direction(shape, J,
                                         {.product = product, .scheme = Scheme::kSemiImplicit});
      const auto& terms = direction.terms;
      const Eigen::VectorXd r =
          terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
      const Solution<2> block(with_load<2>(consistent_blocks<2>(shape, terms, product), shape, r),
                              shape.points(), 0.02);
      difference[level] = (direction.system.solve(0.02).normal - block.V).norm() / block.V.norm();
    }
    EXPECT_LT(difference[2], 0.05);
    for (int level = 1; level < 3; ++level)
      EXPECT_GT(difference[level - 1] / difference[level], 3) << difference[level];
  }
}

}  // namespace
}  // namespace surf::flow
