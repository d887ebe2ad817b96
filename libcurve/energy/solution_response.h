// How the solutions of the Mumford-Shah model answer to a motion of the curves (thesis 2.2.3).
#pragma once

#include "libcurve/energy/neumann.h"
#include "libsurf/base/sparse_cholesky.h"

namespace surf::curve {

/// u'_i = u'_i(Omega_i; W), the shape derivative of the solutions of (2.46): the shape derivative
/// of their weak form (2.48),
///   <mu grad u'_i, grad phi> + <u'_i, phi> = -int_Gamma (mu grad_Gamma u_i . grad_Gamma phi +
///                                            (u_i - I) phi) W_i dS,   W_1 = W, W_2 = -W,
/// whose strong form is that of Theorem 2.2.11. With K its matrix and C W the integral on the right
/// it is u' = -K^-1 C W.
class SolutionResponse {
 public:
  /// Factorises K.
  /// @param elements    of the curves of solution.mesh(), whose vertices are its first nodes
  /// @param n_vertices  their number
  SolutionResponse(const Neumann& solution, const Elements<2>& elements, Eigen::Index n_vertices);

  /// u'_W at the unknowns of the solution.
  /// @param W  normal velocity at the vertices, (n)
  Eigen::VectorXd derivative(const Eigen::VectorXd& W) const;
  /// int_Gamma [(u - I) u'_W] phi_i + mu [grad_Gamma u . grad_Gamma u'_W] phi_i dS, the last line
  /// of Theorem 2.2.11: -C^T K^-1 C W, symmetric and not positive; (n). One solution of the
  /// problem.
  Eigen::VectorXd operator()(const Eigen::VectorXd& W) const;

 private:
  SparseCholesky factor_;
  Eigen::SparseMatrix<double> loads_;  // C
};

}  // namespace surf::curve
