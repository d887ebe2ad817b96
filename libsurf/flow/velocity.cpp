#include "libsurf/flow/velocity.h"

#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <cmath>

#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/cyclic_tridiagonal.h"

namespace surf::flow {
namespace {

// Diagonal preconditioners beat what costs a factorisation: at 4,412 / 16,812 / 65,612 vertices one
// H1 solve takes 0.65 / 9 / 80 ms, with incomplete Cholesky 7 / 28 / 188 ms and by LDLT 15 / 90 /
// 842 ms; BiCGSTAB 0.8 / 11 / 98 ms against GMRES 2.4 / 36 / 489 ms (tests/bench/solver_bench).
using Cg = Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper,
                                    Eigen::DiagonalPreconditioner<double>>;
using BiCgStab = Eigen::BiCGSTAB<SparseMatrix, Eigen::DiagonalPreconditioner<double>>;

void add_to_diagonal(SparseMatrix& matrix, const Eigen::VectorXd& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) matrix.coeffRef(i, i) += values[i];
}

template <class Solver>
Eigen::VectorXd solve_iteratively(const SparseMatrix& matrix, const Eigen::VectorXd& rhs,
                                  double tolerance) {
  Solver solver;
  solver.setTolerance(tolerance);
  solver.setMaxIterations(1000);
  solver.compute(matrix);
  return solver.solve(rhs);
}

/// Directly on curves, else iteratively.
template <int Dim, class Solver>
Eigen::VectorXd solve_system(const SparseMatrix& matrix, const Eigen::VectorXd& rhs,
                             double tolerance) {
  if constexpr (Dim == 2)
    return solve_cyclic_tridiagonal(matrix, rhs);
  else
    return solve_iteratively<Solver>(matrix, rhs, tolerance);
}

}  // namespace

std::string VelocityOptions::error() const {
  if (!(beta_floor > 0))
    return fmt::format("VelocityOptions::beta_floor = {} violates > 0", beta_floor);
  if (!(solver_tolerance > 0 && solver_tolerance < 1))
    return fmt::format("VelocityOptions::solver_tolerance = {} violates 0 < tolerance < 1",
                       solver_tolerance);
  return {};
}

template <int Dim>
struct VelocitySystem<Dim>::Impl {
  Impl(const fem::Geometry<Dim>& the_shape, const energy::ShapeTerms<Dim>& terms,
       const SparseMatrix& A, const VelocityOptions& the_options)
      : shape(the_shape), options(the_options) {
    rhs = -terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const double g_max = terms.g.maxCoeff();
    weight = terms.g.cwiseMax(1e-6 * g_max);
    product_diagonal = shape.lumped_mass();
    if (options.product == ScalarProduct::kH1) {
      product = fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0));
      product_diagonal = product_diagonal.cwiseProduct(terms.beta.cwiseMax(floor(g_max)));
      add_to_diagonal(product, product_diagonal);
    }
    if (options.scheme == Scheme::kSemiImplicit) {
      bending = fem::normal_stiffness<Dim>(shape, A);
      if (options.product == ScalarProduct::kL2) {
        const Eigen::VectorXd root = weight.cwiseSqrt();
        bending = root.asDiagonal() * bending * root.asDiagonal();
      } else {
        bending = weight.asDiagonal() * bending;
      }
    }
  }

  /// Smallest beta [energy / mm^(Dim+1)]. Without a curvature term (g = 0) the scale is that
  /// of the right-hand side: a full step moves the mean vertex by a tenth of the radius.
  double floor(double g_max) const {
    const double r = std::max(shape.radius(), 1e-3 * std::sqrt(shape.measure()));
    if (g_max > 0) return options.beta_floor * g_max / (r * r);
    const double mean_force = rhs.cwiseAbs().sum() / shape.measure();
    return std::max(10 * mean_force / r, 1e-300);
  }

  Eigen::VectorXd normal_velocity(double tau) const {
    const bool implicit = options.scheme == Scheme::kSemiImplicit;
    if (options.product == ScalarProduct::kL2) {
      if (!implicit) return rhs.cwiseQuotient(product_diagonal);
      const Eigen::VectorXd root = weight.cwiseSqrt();
      SparseMatrix matrix = tau * bending;
      add_to_diagonal(matrix, product_diagonal);
      return root.cwiseProduct(
          solve_system<Dim, Cg>(matrix, rhs.cwiseQuotient(root), options.solver_tolerance));
    }
    if (!implicit) return solve_system<Dim, Cg>(product, rhs, options.solver_tolerance);
    return solve_system<Dim, BiCgStab>(product + tau * bending, rhs, options.solver_tolerance);
  }

  const fem::Geometry<Dim>& shape;
  VelocityOptions options;
  Eigen::VectorXd rhs, weight, product_diagonal;
  SparseMatrix product;  // A_alpha + M_beta; empty for L2
  SparseMatrix bending;  // W S, or W^(1/2) S W^(1/2) for L2; empty if explicit
};

template <int Dim>
VelocitySystem<Dim>::VelocitySystem(const fem::Geometry<Dim>& shape,
                                    const energy::ShapeTerms<Dim>& terms, const SparseMatrix& A,
                                    const VelocityOptions& options)
    : impl_(std::make_unique<Impl>(shape, terms, A, options)) {}

template <int Dim>
VelocitySystem<Dim>::~VelocitySystem() = default;

template <int Dim>
bool VelocitySystem<Dim>::depends_on_step() const {
  return impl_->options.scheme == Scheme::kSemiImplicit;
}

template <int Dim>
Velocity<Dim> VelocitySystem<Dim>::solve(double tau) const {
  Velocity<Dim> velocity;
  velocity.normal = impl_->normal_velocity(tau);
  velocity.vector = velocity.normal.asDiagonal() * impl_->shape.nodal_normals();
  velocity.shape_derivative = -impl_->rhs.dot(velocity.normal);
  velocity.norm_squared = impl_->options.product == ScalarProduct::kL2
                              ? velocity.normal.cwiseAbs2().dot(impl_->product_diagonal)
                              : velocity.normal.dot(impl_->product * velocity.normal);
  return velocity;
}

template class VelocitySystem<2>;
template class VelocitySystem<3>;

}  // namespace surf::flow
