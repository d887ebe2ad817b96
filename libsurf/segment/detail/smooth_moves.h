// Moves of a shape that make it as smooth as the image lets it be.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "libsurf/base/sparse_cholesky.h"
#include "libsurf/fem/geometry.h"

namespace surf::segment {

/// What observations say of the moves u of the vertices along their normals:
/// -log p(data | u) = u^T P u / 2 - b^T u + const.
struct Observations {
  Eigen::SparseMatrix<double> P;  ///< (n, n)
  Eigen::VectorXd b;              ///< (n)
};

/// A diag(d) A of a shape's stiffness matrix A for any d: all have the same nonzeros, which are
/// found once, with the order of their Cholesky factors. Those of the observations are among them.
class BendingMatrices {
 public:
  /// @param observed  has the nonzeros of the observations, (n, n): of a part of a shape they may
  ///                  couple vertices whose elements are left out; empty: those of the geometry
  template <int Dim>
  explicit BendingMatrices(const fem::Geometry<Dim>& geometry,
                           Eigen::SparseMatrix<double> observed = {});

  const Eigen::SparseMatrix<double>& stiffness() const { return A_; }
  const CholeskyPattern& cholesky() const { return *cholesky_; }
  /// A diag(d) A, (n, n).
  Eigen::SparseMatrix<double> operator()(const Eigen::VectorXd& d) const;

 private:
  Eigen::SparseMatrix<double> A_, zero_;
  std::vector<int> places_;          // in the values, of each product of two entries of A
  std::vector<std::size_t> begins_;  // of a column's products
  std::unique_ptr<const CholeskyPattern> cholesky_;
};

/// The prior of the moves: the curvature of the moved shape varies little over less than a length
/// L, but for few places such as edges. In the spirit of a smoothing spline,
///
///   -log p(u) = tau / 2 sum_i m_i w_i q_i^2,   q = M^-1 A (u - u_s),
///
/// M the lumped mass, A the stiffness; u_s takes off what in the shape is shorter than 1.5 L,
/// u_s = -(H H X) . n with the high-pass filter H = (M + k^-4 A M^-1 A)^-1 k^-4 A M^-1 A at k =
/// 2 pi / (1.5 L). So the shape's own noise, which comes from the same cells, is no evidence for
/// itself, and longer waves are left to the observations. w_i = (nu + 1) / (nu + tau m_i q_i^2), nu
/// = 3, makes the sum a Student distribution's: few large q, as along the edges of a box, cost
/// little.
template <int Dim>
class SmoothMoves {
 public:
  /// @param bending  of the geometry; must outlive it
  /// @param normals  of the vertices; on the image's border nothing is known
  SmoothMoves(const BendingMatrices& bending, const fem::Geometry<Dim>& geometry,
              const Points<Dim>& normals, double length_mm);
  /// Of a part, with the u_s of the whole at its vertices: its own would bend at its rim.
  static SmoothMoves of_part(const BendingMatrices& bending, const fem::Geometry<Dim>& geometry,
                             const Eigen::VectorXd& smoothing, double length_mm) {
    SmoothMoves out(bending, geometry, length_mm);
    out.smoothing_ = smoothing;
    return out;
  }

  /// u_s, (n).
  const Eigen::VectorXd& smoothing() const { return smoothing_; }
  /// tau at which the prior outweighs observations of this much information per length or area for
  /// waves shorter than L.
  double stiffness(double information) const;
  /// w for these moves, (n).
  Eigen::VectorXd weights(const Eigen::VectorXd& moves, double tau) const;
  /// The prior's precision, (n, n).
  Eigen::SparseMatrix<double> precision(double tau, const Eigen::VectorXd& weights) const;

 private:
  SmoothMoves(const BendingMatrices& bending, const fem::Geometry<Dim>& geometry, double length_mm);

  const BendingMatrices& bending_;
  double k_;
  Eigen::VectorXd mass_, is_free_, smoothing_;
};

/// Moves after the observations: Gaussian, of precision Q + P.
class Posterior {
 public:
  /// @param pattern      of Q + P
  /// @param Q            of the prior
  /// @param mean_before  of the prior, (n)
  Posterior(const CholeskyPattern& pattern, const Eigen::SparseMatrix<double>& Q,
            const Observations& data, const Eigen::VectorXd& mean_before);
  const Eigen::VectorXd& mean() const { return mean_; }
  /// Variance of each value, (n): the diagonal of (Q + P)^-1, exact.
  Eigen::VectorXd variances() const { return factor_.inverse_diagonal(); }
  /// Variance of c^T u.
  double variance_of(const Eigen::VectorXd& c) const;
  /// How far the prior pulls the mean from what the observations alone say, to first order:
  /// (Q + P)^-1 Q (mean - mean_before), (n).
  Eigen::VectorXd pull() const { return factor_.solve(prior_force_); }

 private:
  SparseCholesky factor_;
  Eigen::VectorXd mean_;
  Eigen::VectorXd prior_force_;  // Q (mean - mean_before)
};

/// The moves after observations of usual strength, by a prior whose weights are those of the moves.
/// @param bending  of the geometry, as the prior's
template <int Dim>
Posterior posterior(const SmoothMoves<Dim>& prior, const BendingMatrices& bending,
                    const fem::Geometry<Dim>& geometry, const Observations& data,
                    const Eigen::VectorXd& moves);

}  // namespace surf::segment
