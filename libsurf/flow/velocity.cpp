#include "libsurf/flow/velocity.h"

#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <cmath>
#include <optional>
#include <vector>

#include "libsurf/base/log.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/detail/cyclic_tridiagonal.h"
#include "libsurf/flow/detail/symmetric_solver.h"

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
  Eigen::VectorXd x = solver.solve(rhs);
  if (solver.info() != Eigen::Success)
    log(LogLevel::kWarning,
        fmt::format("velocity: the residual is {:.1e} of the load after {} iterations, not {:g}",
                    solver.error(), solver.iterations(), tolerance));
  return x;
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

namespace {

/// Smallest beta [energy / mm^(Dim+1)]. Without a curvature term (g = 0) the scale is that
/// of the right-hand side: a full step moves the mean vertex by a tenth of the radius.
template <int Dim>
double smallest_beta(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                     double beta_floor) {
  const double r = std::max(shape.radius(), 1e-3 * std::sqrt(shape.measure()));
  const double stiffness = std::max(terms.g.maxCoeff(), terms.bilaplacian.maxCoeff() / (r * r));
  if (stiffness > 0) return beta_floor * stiffness / (r * r);
  const Eigen::VectorXd force = terms.derivative.cwiseProduct(shape.directions()).rowwise().sum();
  const double mean_force = force.cwiseAbs().sum() / shape.measure();
  return std::max(10 * mean_force / r, 1e-300);
}

}  // namespace

template <int Dim>
SparseMatrix h1_product(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                        const SparseMatrix& A, double beta_floor) {
  SparseMatrix product = fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0));
  const double floor = smallest_beta<Dim>(shape, terms, beta_floor);
  add_to_diagonal(product, shape.lumped_mass().cwiseProduct(terms.beta.cwiseMax(floor)));
  if (terms.bilaplacian.maxCoeff() > 0)
    product += bilaplacian_matrix<Dim>(shape, A, terms.bilaplacian);
  return product;
}

std::string to_string(ScalarProduct product) {
  return product == ScalarProduct::kL2 ? "l2" : product == ScalarProduct::kH1 ? "h1" : "h-1";
}

template <int Dim>
struct VelocitySystem<Dim>::Impl {
  Impl(const fem::Geometry<Dim>& the_shape, const energy::ShapeTerms<Dim>& terms,
       const SparseMatrix& the_A, const VelocityOptions& the_options)
      : shape(the_shape), options(the_options), A(the_A) {
    rhs = -terms.derivative.cwiseProduct(shape.directions()).rowwise().sum();
    content_derivative = shape.content_derivative();
    if (options.product == ScalarProduct::kHMinus1)
      for (Eigen::Index i = 0; i < rhs.size(); ++i)  // what does not move, so that it may divide
        if (shape.directions().row(i).isZero(0)) content_derivative[i] = shape.lumped_mass()[i];
    product_diagonal = shape.lumped_mass();
    has_direct_solver =
        options.product == ScalarProduct::kHMinus1 || terms.bilaplacian.maxCoeff() > 0;
    if (options.product == ScalarProduct::kH1)
      product = h1_product<Dim>(shape, terms, A, options.beta_floor);
    if (options.scheme != Scheme::kSemiImplicit) return;
    if (has_direct_solver && std::max(terms.alpha.maxCoeff(), terms.bilaplacian.maxCoeff()) > 0)
      implicit = principal_part(terms);
    else if (!has_direct_solver && terms.g.maxCoeff() > 0)
      set_bending(terms);
  }

  /// W S, or W^(1/2) S W^(1/2) for L2.
  void set_bending(const energy::ShapeTerms<Dim>& terms) {
    weight = terms.g.cwiseMax(1e-6 * terms.g.maxCoeff());
    implicit = fem::normal_stiffness<Dim>(shape, A);
    if (options.product == ScalarProduct::kL2) {
      const Eigen::VectorXd root = weight.cwiseSqrt();
      implicit = root.asDiagonal() * implicit * root.asDiagonal();
    } else {
      implicit = weight.asDiagonal() * implicit;
    }
  }

  SparseMatrix principal_part(const energy::ShapeTerms<Dim>& terms) const {
    return fem::normal_stiffness<Dim>(shape, fem::stiffness<Dim>(shape, terms.alpha.cwiseMax(0))) +
           bilaplacian_matrix<Dim>(shape, A, terms.bilaplacian);
  }

  bool is_implicit() const { return implicit.rows() > 0; }

  /// V of b(V, W) + tau a(V, W) = load(W).
  Eigen::VectorXd solve(double tau, const Eigen::VectorXd& load) const {
    if (options.product == ScalarProduct::kHMinus1) return content_keeping(potential(tau, load));
    if (has_direct_solver) return solve_directly(tau, load);
    const bool is_l2 = options.product == ScalarProduct::kL2;
    if (!is_implicit())
      return is_l2 ? Eigen::VectorXd(load.cwiseQuotient(product_diagonal))
                   : solve_system<Dim, Cg>(product, load, options.solver_tolerance);
    if (!is_l2)
      return solve_system<Dim, BiCgStab>(product + tau * implicit, load, options.solver_tolerance);
    const Eigen::VectorXd root = weight.cwiseSqrt();
    SparseMatrix matrix = tau * implicit;
    add_to_diagonal(matrix, product_diagonal);
    return root.cwiseProduct(
        solve_system<Dim, Cg>(matrix, load.cwiseQuotient(root), options.solver_tolerance));
  }

  /// L2 and H1 of energies of fourth order.
  Eigen::VectorXd solve_directly(double tau, const Eigen::VectorXd& load) const {
    if (!is_implicit() && options.product == ScalarProduct::kL2)
      return load.cwiseQuotient(product_diagonal);
    if (!factor || tau != factor_tau) {
      SparseMatrix matrix = options.product == ScalarProduct::kH1 ? product : diagonal_matrix();
      if (is_implicit()) matrix += tau * implicit;
      factor.emplace(matrix);
      factor_tau = tau;
    }
    return factor->solve(load);
  }

  SparseMatrix diagonal_matrix() const {
    SparseMatrix out(product_diagonal.size(), product_diagonal.size());
    out.setIdentity();
    out.diagonal() = product_diagonal;
    return out;
  }

  /// p of H^-1.
  Eigen::VectorXd potential(double tau, const Eigen::VectorXd& load) const {
    if (!is_implicit() || !(tau > 0)) return load.cwiseQuotient(content_derivative);
    if (!factor || tau != factor_tau) {
      factor.emplace(mixed_matrix(tau));
      factor_tau = tau;
    }
    const Eigen::Index n = load.size();
    Eigen::VectorXd both = Eigen::VectorXd::Zero(2 * n);
    both.head(n) = load;
    return factor->solve(both).tail(n);
  }

  /// ((tau a, M), (M, -A)), as symmetric quasi-definite as tau a and A are definite.
  SparseMatrix mixed_matrix(double tau) const {
    const Eigen::Index n = shape.n_vertices();
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(implicit.nonZeros() + A.nonZeros() + 2 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (SparseMatrix::InnerIterator at(implicit, i); at; ++at)
        entries.emplace_back(i, at.col(), tau * at.value());
      for (SparseMatrix::InnerIterator at(A, i); at; ++at)
        entries.emplace_back(n + i, n + at.col(), -at.value());
      entries.emplace_back(i, n + i, content_derivative[i]);
      entries.emplace_back(n + i, i, content_derivative[i]);
    }
    SparseMatrix out(2 * n, 2 * n);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  /// V = M^-1 A p.
  Eigen::VectorXd content_keeping(const Eigen::VectorXd& p) const {
    return (A * p).cwiseQuotient(content_derivative);
  }

  double norm_squared(double tau, const Eigen::VectorXd& V) const {
    if (options.product == ScalarProduct::kL2) return V.cwiseAbs2().dot(product_diagonal);
    if (options.product == ScalarProduct::kH1) return V.dot(product * V);
    const Eigen::VectorXd p = potential(tau, rhs);
    return p.dot(A * p);
  }

  /// Removes from V what changes the content.
  void keep_content(double tau, Velocity<Dim>& velocity) const {
    Eigen::VectorXd& y = velocity.content_direction;
    if (options.product == ScalarProduct::kHMinus1) {
      y = Eigen::VectorXd::Ones(shape.n_vertices());
      return;
    }
    y = content_derivative;
    if (y.isZero(0)) return;  // no vertex can move
    y = solve(tau, content_derivative);
    velocity.multiplier = content_derivative.dot(velocity.normal) / content_derivative.dot(y);
    velocity.normal -= velocity.multiplier * y;
  }

  const fem::Geometry<Dim>& shape;
  VelocityOptions options;
  const SparseMatrix& A;
  Eigen::VectorXd rhs, content_derivative, weight, product_diagonal;
  SparseMatrix product;   // H1: A_alpha + M_beta, and K
  SparseMatrix implicit;  // what tau multiplies; empty if explicit
  bool has_direct_solver = false;
  mutable std::optional<SymmetricSolver> factor;  // at factor_tau
  mutable double factor_tau = 0;
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
  return impl_->is_implicit();
}

template <int Dim>
Velocity<Dim> VelocitySystem<Dim>::solve(double tau) const {
  Velocity<Dim> velocity;
  velocity.normal = impl_->solve(tau, impl_->rhs);
  if (impl_->options.keeps_content) impl_->keep_content(tau, velocity);
  velocity.vector = velocity.normal.asDiagonal() * impl_->shape.directions();
  velocity.shape_derivative = -impl_->rhs.dot(velocity.normal);
  velocity.norm_squared = impl_->norm_squared(tau, velocity.normal);
  return velocity;
}

template SparseMatrix h1_product<2>(const fem::Geometry<2>&, const energy::ShapeTerms<2>&,
                                    const SparseMatrix&, double);
template SparseMatrix h1_product<3>(const fem::Geometry<3>&, const energy::ShapeTerms<3>&,
                                    const SparseMatrix&, double);
template class VelocitySystem<2>;
template class VelocitySystem<3>;

}  // namespace surf::flow
