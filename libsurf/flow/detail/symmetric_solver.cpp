#include "libsurf/flow/detail/symmetric_solver.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>

#include "libsurf/base/log.h"

namespace surf::flow {
namespace {

using ColumnMatrix = Eigen::SparseMatrix<double>;

constexpr double kShift = 1e-11;  // of an entry of the diagonal

/// Rows and columns scaled by the roots of the largest entries: blocks of different units.
Eigen::VectorXd scale_of(const SparseMatrix& matrix) {
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(matrix.rows());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const double entry = std::abs(matrix.coeff(i, i));
    if (entry > 0 && std::isfinite(entry)) scale[i] = 1 / std::sqrt(entry);
  }
  return scale;
}

}  // namespace

struct SymmetricSolver::Impl {
  explicit Impl(const SparseMatrix& the_matrix) : scale(scale_of(the_matrix)) {
    matrix = scale.asDiagonal() * ColumnMatrix(the_matrix) * scale.asDiagonal();
    ColumnMatrix shifted = matrix;
    for (Eigen::Index i = 0; i < shifted.rows(); ++i) {
      double& entry = shifted.coeffRef(i, i);
      entry += entry < 0 ? -kShift : kShift;
    }
    factor.compute(shifted);
    if (factor.info() != Eigen::Success)
      log(LogLevel::kWarning, "velocity: the system's matrix has no factorisation");
  }

  Eigen::VectorXd scale;
  ColumnMatrix matrix;  // scaled
  Eigen::SimplicialLDLT<ColumnMatrix> factor;
};

SymmetricSolver::SymmetricSolver(const SparseMatrix& matrix)
    : impl_(std::make_unique<Impl>(matrix)) {}
SymmetricSolver::~SymmetricSolver() = default;
SymmetricSolver::SymmetricSolver(SymmetricSolver&&) noexcept = default;
SymmetricSolver& SymmetricSolver::operator=(SymmetricSolver&&) noexcept = default;

Eigen::VectorXd SymmetricSolver::solve(const Eigen::VectorXd& rhs, int n_refinements) const {
  if (impl_->factor.info() != Eigen::Success)
    return Eigen::VectorXd::Constant(rhs.size(), std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXd scaled = impl_->scale.cwiseProduct(rhs);
  Eigen::VectorXd x = impl_->factor.solve(scaled);
  for (int k = 0; k < n_refinements; ++k) x += impl_->factor.solve(scaled - impl_->matrix * x);
  return impl_->scale.cwiseProduct(x);
}

template <int Dim>
SparseMatrix bilaplacian_matrix(const fem::Geometry<Dim>& shape, const SparseMatrix& A,
                                const Eigen::VectorXd& c) {
  const Eigen::VectorXd weight = c.cwiseMax(0).cwiseQuotient(shape.lumped_mass());
  return A * weight.asDiagonal() * A;
}

template SparseMatrix bilaplacian_matrix<2>(const fem::Geometry<2>&, const SparseMatrix&,
                                            const Eigen::VectorXd&);
template SparseMatrix bilaplacian_matrix<3>(const fem::Geometry<3>&, const SparseMatrix&,
                                            const Eigen::VectorXd&);

}  // namespace surf::flow
