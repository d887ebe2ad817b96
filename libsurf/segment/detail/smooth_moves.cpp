#include "libsurf/segment/detail/smooth_moves.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "libsurf/fem/stiffness.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr double kStudent = 3;  // degrees of freedom
// Of L: waves that the prior leaves to the observations are not taken from the shape either, where
// they would speak for themselves. At 1 the halves of the cells ask for too short an L (16 in place
// of 24 cells on a ball under noise of 0.2, which then is 0.050 voxel off in place of 0.031).
constexpr double kReference = 1.5;
// Of the mean mass: vertices whose elements all lie on the image's border have none of their own.
constexpr double kLeastMass = 1e-3;
constexpr double kUnseen = 1e-9;  // of the least information: what nothing is known of stays
// Of a diagonal entry: where a part that nothing is known of has an element that is much smaller
// than the others, rounding is more than the information above.
constexpr double kRounding = 1e-12;

}  // namespace

template <int Dim>
BendingMatrices::BendingMatrices(const fem::Geometry<Dim>& geometry, Sparse observed)
    : A_(fem::stiffness<Dim>(geometry, Eigen::VectorXd::Ones(geometry.n_elements()))) {
  Sparse ones = A_;
  ones.coeffs().setOnes();  // so that no entry of the product is 0 by chance
  if (observed.rows() == 0) observed = geometry.topology().pattern();
  observed.coeffs().setOnes();
  zero_ = Sparse(ones * ones) + observed;
  std::vector<int> place(std::size_t(A_.rows()));
  for (int j = 0; j < A_.cols(); ++j) {
    begins_.push_back(places_.size());
    const int* rows = zero_.innerIndexPtr();
    for (int at = zero_.outerIndexPtr()[j]; at < zero_.outerIndexPtr()[j + 1]; ++at)
      place[std::size_t(rows[at])] = at;
    for (Sparse::InnerIterator first(A_, j); first; ++first)
      for (Sparse::InnerIterator second(A_, first.row()); second; ++second)
        places_.push_back(place[std::size_t(second.row())]);
  }
  cholesky_ = std::make_unique<CholeskyPattern>(zero_);
  zero_.coeffs().setZero();
}

Sparse BendingMatrices::operator()(const Eigen::VectorXd& d) const {
  Sparse out = zero_;
  double* values = out.valuePtr();
  tbb::parallel_for(tbb::blocked_range<int>(0, int(A_.cols())), [&](const auto& columns) {
    for (int j = columns.begin(); j < columns.end(); ++j) {
      const int* place = places_.data() + begins_[std::size_t(j)];
      for (Sparse::InnerIterator first(A_, j); first; ++first) {
        const double factor = first.value() * d[first.row()];
        for (Sparse::InnerIterator second(A_, first.row()); second; ++second)
          values[*place++] += factor * second.value();
      }
    }
  });
  return out;
}

template <int Dim>
SmoothMoves<Dim>::SmoothMoves(const BendingMatrices& bending, const fem::Geometry<Dim>& geometry,
                              double length_mm)
    : bending_(bending),
      k_(2 * std::numbers::pi / length_mm),
      mass_(geometry.lumped_mass().cwiseMax(kLeastMass * geometry.lumped_mass().mean())),
      is_free_(Eigen::VectorXd::Ones(mass_.size())) {
  for (Eigen::Index i = 0; i < mass_.size(); ++i)
    if (geometry.is_on_border(i)) is_free_[i] = 0;
}

template <int Dim>
SmoothMoves<Dim>::SmoothMoves(const BendingMatrices& bending, const fem::Geometry<Dim>& geometry,
                              const Points<Dim>& normals, double length_mm)
    : SmoothMoves(bending, geometry, length_mm) {
  const Sparse high = std::pow(k_ / kReference, -4) * bending_(mass_.cwiseInverse());
  const SparseCholesky factor(bending_.cholesky(), high + Sparse(mass_.asDiagonal()));
  Eigen::MatrixXd X = geometry.points();
  for (int time = 0; time < 2; ++time) X = factor.solve(high * X);
  smoothing_ = -(X.array() * normals.array()).rowwise().sum().matrix().cwiseProduct(is_free_);
}

template <int Dim>
double SmoothMoves<Dim>::stiffness(double information) const {
  return information / std::pow(k_, 4);
}

template <int Dim>
Eigen::VectorXd SmoothMoves<Dim>::weights(const Eigen::VectorXd& moves, double tau) const {
  const Eigen::ArrayXd q = (bending_.stiffness() * (moves - smoothing_)).array() / mass_.array();
  return is_free_.array() * (kStudent + 1) / (kStudent + tau * mass_.array() * q.square());
}

template <int Dim>
Sparse SmoothMoves<Dim>::precision(double tau, const Eigen::VectorXd& weights) const {
  Sparse out = tau * bending_(weights.cwiseQuotient(mass_));
  const Eigen::VectorXd diagonal = out.diagonal();
  const Eigen::VectorXd least =
      (kUnseen * tau * std::pow(k_, 4) * mass_).cwiseMax(kRounding * diagonal);
  out += Sparse(least.asDiagonal());
  return out;
}

Posterior::Posterior(const CholeskyPattern& pattern, const Sparse& Q, const Observations& data,
                     const Eigen::VectorXd& mean_before)
    : factor_(pattern, Q + data.P) {
  if (!factor_.is_definite())
    throw std::logic_error("smooth moves: the precision is not positive definite");
  mean_ = factor_.solve(Q * mean_before + data.b);
  prior_force_ = Q * (mean_ - mean_before);
}

double Posterior::variance_of(const Eigen::VectorXd& c) const {
  return c.dot(factor_.solve(c).col(0));
}

template <int Dim>
Posterior posterior(const SmoothMoves<Dim>& prior, const BendingMatrices& bending,
                    const fem::Geometry<Dim>& geometry, const Observations& data,
                    const Eigen::VectorXd& moves) {
  const Eigen::VectorXd information = (data.P * Eigen::VectorXd::Ones(data.b.size()))
                                          .cwiseQuotient(geometry.lumped_mass().cwiseMax(1e-300));
  // Of the vertices that see cells: those on the image's border do not.
  std::vector<double> seen;
  for (const double one : information)
    if (one > 0) seen.push_back(one);
  const double tau = prior.stiffness(seen.empty() ? 1 : median(std::move(seen)));
  return {bending.cholesky(), prior.precision(tau, prior.weights(moves, tau)), data,
          prior.smoothing()};
}

#define SURF_INSTANTIATE(Dim)                                                        \
  template BendingMatrices::BendingMatrices(const fem::Geometry<Dim>&, Sparse);      \
  template class SmoothMoves<Dim>;                                                   \
  template Posterior posterior<Dim>(const SmoothMoves<Dim>&, const BendingMatrices&, \
                                    const fem::Geometry<Dim>&, const Observations&,  \
                                    const Eigen::VectorXd&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
