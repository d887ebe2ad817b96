#include "libsurf/segment/smooth_moves.h"

#include <Eigen/SparseCholesky>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Solver = Eigen::SimplicialLDLT<Sparse>;

constexpr double kStudent = 3;  // degrees of freedom
// Of L: waves that the prior leaves to the observations are not taken from the shape either, where
// they would speak for themselves. At 1 the halves of the cells ask for too short an L (16 in place
// of 24 cells on a ball under noise of 0.2, which then is 0.050 voxel off in place of 0.031).
constexpr double kReference = 1.5;
// Of the mean mass: vertices whose elements all lie on the image's border have none of their own.
constexpr double kLeastMass = 1e-3;
constexpr double kUnseen = 1e-9;  // of the least information: what nothing is known of stays

}  // namespace

template <int Dim>
SmoothMoves<Dim>::SmoothMoves(const fem::Geometry<Dim>& geometry, const Points<Dim>& normals,
                              double length_mm)
    : k_(2 * std::numbers::pi / length_mm),
      mass_(geometry.lumped_mass().cwiseMax(kLeastMass * geometry.lumped_mass().mean())),
      is_free_(Eigen::VectorXd::Ones(mass_.size())),
      A_(fem::stiffness<Dim>(geometry, Eigen::VectorXd::Ones(geometry.n_elements()))) {
  for (Eigen::Index i = 0; i < mass_.size(); ++i)
    if (geometry.is_on_border(i)) is_free_[i] = 0;
  const Sparse scaled = mass_.cwiseInverse().asDiagonal() * A_;
  const Sparse bilaplacian = std::pow(k_ / kReference, -4) * (A_ * scaled);
  const Solver solver(Sparse(bilaplacian + Sparse(mass_.asDiagonal())));
  Eigen::MatrixXd X = geometry.points();
  for (int time = 0; time < 2; ++time) X = solver.solve(Eigen::MatrixXd(bilaplacian * X)).eval();
  smoothing_ = -(X.array() * normals.array()).rowwise().sum().matrix().cwiseProduct(is_free_);
}

template <int Dim>
double SmoothMoves<Dim>::stiffness(double information) const {
  return information / std::pow(k_, 4);
}

template <int Dim>
Eigen::VectorXd SmoothMoves<Dim>::weights(const Eigen::VectorXd& moves, double tau) const {
  const Eigen::ArrayXd q = (A_ * (moves - smoothing_)).array() / mass_.array();
  return is_free_.array() * (kStudent + 1) / (kStudent + tau * mass_.array() * q.square());
}

template <int Dim>
Sparse SmoothMoves<Dim>::precision(double tau, const Eigen::VectorXd& weights) const {
  const Sparse scaled = weights.cwiseQuotient(mass_).asDiagonal() * A_;
  Sparse out = tau * (A_ * scaled);
  out += Sparse((kUnseen * tau * std::pow(k_, 4) * mass_).asDiagonal());
  return out;
}

struct Posterior::Factor {
  explicit Factor(const Sparse& precision) : solver(precision) {}
  Solver solver;
};

Posterior::Posterior(const Sparse& Q, const Observations& data, const Eigen::VectorXd& mean_before)
    : factor_(std::make_unique<Factor>(Sparse(Q + data.P))) {
  if (factor_->solver.info() != Eigen::Success)
    throw std::logic_error("smooth moves: the precision is not positive definite");
  mean_ = factor_->solver.solve(Q * mean_before + data.b);
  pull_ = factor_->solver.solve(Q * (mean_ - mean_before));
}

Posterior::Posterior(Posterior&&) noexcept = default;
Posterior::~Posterior() = default;

Eigen::VectorXd Posterior::variances() const {
  const Sparse L = factor_->solver.matrixL();
  const Eigen::VectorXd& D = factor_->solver.vectorD();
  const int n = int(L.cols());
  // Z = (L D L^T)^-1 on the pattern of L, column by column from the last:
  // Z_ij = [i = j] / d_j - sum_{k > j} Z_ik L_kj.
  Sparse Z = L;
  const int *outer = L.outerIndexPtr(), *inner = L.innerIndexPtr();
  const double* l = L.valuePtr();
  double* z = Z.valuePtr();
  std::vector<double> sum(std::size_t(n), 0), factor(std::size_t(n), 0);
  std::vector<char> is_in(std::size_t(n), 0);
  Eigen::VectorXd diagonal(n);
  for (int j = n - 1; j >= 0; --j) {
    int begin = outer[j];
    const int end = outer[j + 1];
    const bool has_diagonal = begin < end && inner[begin] == j;
    if (has_diagonal) ++begin;
    for (int at = begin; at < end; ++at) {
      factor[inner[at]] = l[at];
      is_in[inner[at]] = 1;
    }
    for (int at = begin; at < end; ++at) {
      const int k = inner[at];
      sum[k] += diagonal[k] * l[at];
      for (int row = outer[k]; row < outer[k + 1]; ++row) {
        const int i = inner[row];
        if (i == k || !is_in[i]) continue;
        sum[i] += z[row] * l[at];
        sum[k] += z[row] * factor[i];
      }
    }
    double own = 1 / D[j];
    for (int at = begin; at < end; ++at) {
      const int k = inner[at];
      z[at] = -sum[k];
      own -= z[at] * l[at];
      sum[k] = 0;
      is_in[k] = 0;
    }
    diagonal[j] = own;
  }
  return factor_->solver.permutationPinv() * diagonal;
}

double Posterior::variance_of(const Eigen::VectorXd& c) const {
  return c.dot(factor_->solver.solve(c));
}

template class SmoothMoves<2>;
template class SmoothMoves<3>;

}  // namespace surf::segment
