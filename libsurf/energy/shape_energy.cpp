#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

template <int Dim>
void SecondDerivative<Dim>::add_integrals(const Eigen::MatrixXd& more_vectors,
                                          const Eigen::MatrixXd& more_coefficients) {
  const Eigen::Index old = vectors.cols(), more = more_vectors.cols();
  vectors.conservativeResize(vectors.rows(), old + more);
  vectors.rightCols(more) = more_vectors;
  coefficients.conservativeResize(old + more, old + more);
  coefficients.topRightCorner(old, more).setZero();
  coefficients.bottomLeftCorner(more, old).setZero();
  coefficients.bottomRightCorner(more, more) = more_coefficients;
}

template <int Dim>
Eigen::VectorXd SecondDerivative<Dim>::times(const fem::Geometry<Dim>& shape, const SparseMatrix& A,
                                             const Eigen::VectorXd& W) const {
  Eigen::VectorXd out = sparse * W;
  if (!bilaplacian.isZero(0))
    out += A * bilaplacian.cwiseQuotient(shape.lumped_mass()).cwiseProduct(A * W);
  if (vectors.cols() > 0) out += vectors * (coefficients * (vectors.transpose() * W));
  for (const auto& product : operators) out += product(W);
  return out;
}

template struct SecondDerivative<2>;
template struct SecondDerivative<3>;

}  // namespace surf::energy
