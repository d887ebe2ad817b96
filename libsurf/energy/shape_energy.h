// What every shape energy offers to the flows.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "libsurf/fem/curvature.h"
#include "libsurf/fem/geometry.h"

namespace surf::energy {

/// First derivative and scalar-product weights of an energy at one shape Gamma, summed over
/// the terms of a weighted sum.
template <int Dim>
struct ShapeTerms {
  explicit ShapeTerms(const fem::Geometry<Dim>& shape)
      : derivative(Points<Dim>::Zero(shape.n_vertices(), Dim)),
        g(Eigen::VectorXd::Zero(shape.n_vertices())),
        alpha(Eigen::VectorXd::Zero(shape.n_elements())),
        beta(Eigen::VectorXd::Zero(shape.n_vertices())),
        bilaplacian(Eigen::VectorXd::Zero(shape.n_vertices())) {}

  /// dJ(Gamma; phi_i e_k): the exact derivative of the discrete J (with its quadrature) with
  /// respect to vertex i, (n, Dim). So the step control sees the energy whose derivative the
  /// flow follows. Its normal part converges to the weak form <G, phi_i> of the
  /// shape gradient G = g kappa + f (1.13): derivative_i . n_i -> (M_g K + f)_i of (3.53).
  Points<Dim> derivative;
  /// Coefficient g of the curvature in G at the vertices, (n); the implicit part of (3.54). 0 for
  /// energies of fourth order, which do not have the form (1.13).
  Eigen::VectorXd g;
  /// Weights of the scalar product <alpha grad V, grad W> + <beta V, W> (3.8) from the second
  /// derivative: alpha per element (m), beta per vertex (n). beta may be negative here; the
  /// positive part is taken of the sum of all terms.
  Eigen::VectorXd alpha, beta;
  /// Weight c of int c Lap V Lap W in the scalar product of energies of fourth order, per vertex
  /// (n); 0 for all others.
  Eigen::VectorXd bilaplacian;
};

/// The second derivative d2J(Gamma; V, W) at one shape for normal velocities V, W that are constant
/// along the normals (2.23), as a bilinear form on P1 functions:
///   V^T (S + A M^-1 diag(c) A + U C U^T + L) W
/// with A, M the stiffness and the lumped mass. It is the mixed derivative of
/// J(X + s V nu + t W nu) at s = t = 0, summed over the terms of a weighted sum.
template <int Dim>
struct SecondDerivative {
  explicit SecondDerivative(const fem::Geometry<Dim>& shape)
      : sparse(shape.topology().pattern()),
        bilaplacian(Eigen::VectorXd::Zero(shape.n_vertices())),
        vectors(shape.n_vertices(), 0) {}

  /// Adds the rank-one terms vectors * coefficients * vectors^T.
  void add_integrals(const Eigen::MatrixXd& more_vectors, const Eigen::MatrixXd& more_coefficients);
  /// (S + A M^-1 diag(c) A + U C U^T + L) W.
  /// @param A  stiffness(shape, 1)
  Eigen::VectorXd times(const fem::Geometry<Dim>& shape, const SparseMatrix& A,
                        const Eigen::VectorXd& W) const;

  SparseMatrix sparse;          ///< S (n, n), with the sparsity of the shape's topology
  Eigen::VectorXd bilaplacian;  ///< c (n): int c Lap V Lap W; 0 but for energies of fourth order
  /// The rank-one terms of integrals (Theorems 2.2.7 and 2.2.9), applied and never assembled:
  Eigen::MatrixXd vectors;       ///< U (n, r): columns <u, phi_i>
  Eigen::MatrixXd coefficients;  ///< C (r, r), symmetric
  /// L = their sum: symmetric operators (n) -> (n), each product of which solves a boundary value
  /// problem (Theorem 2.2.11). They hold what they need of the energy at the shape.
  std::vector<std::function<Eigen::VectorXd(const Eigen::VectorXd&)>> operators;
};

/// A shape energy J. It keeps its value at a current shape, so that domain integrals need not
/// be computed anew: their change is what the surface sweeps.
///
/// Order of calls: reset; then any of value, differentiate, try_move (each replaces the last
/// try), accept, remesh. Not thread-safe.
template <int Dim>
class ShapeEnergy {
 public:
  virtual ~ShapeEnergy() = default;

  virtual std::string name() const = 0;
  /// Takes `shape` as current and computes every integral from scratch (domain integrals cost
  /// work in proportion to the enclosed volume).
  virtual void reset(const fem::Geometry<Dim>& shape) = 0;
  /// J at the current shape, but for drift().
  virtual double value() const = 0;
  /// What remesh() and rebuild() have added to J since the last reset, where value() leaves it out:
  /// between two values lies what steps have gained, though mending should take it back.
  virtual double drift() const { return 0; }
  /// J at `moved`, which has the topology of the current shape. Only remembered by accept.
  virtual double try_move(const fem::Geometry<Dim>& moved) = 0;
  /// Takes the shape of the last try_move as current.
  virtual void accept() = 0;
  /// Takes `shape`, another mesh of (nearly) the same domain, as current: boundary integrals
  /// are computed anew, domain integrals are kept but for the change of the content where the
  /// derivative depends on them.
  virtual void remesh(const fem::Geometry<Dim>& shape) = 0;
  /// Takes `shape`, whose domain has been changed by topology surgery, as current. What the
  /// derivative depends on follows the change, or is computed anew if `shape` is the current one; J
  /// may be off by a constant until the next reset.
  virtual void rebuild(const fem::Geometry<Dim>& shape) { reset(shape); }
  /// Adds weight * (first derivative, g, alpha, beta) at the current shape.
  /// @param curvature  of the current shape, for alpha, beta and the bilaplacian
  virtual void differentiate(const fem::Curvature& curvature, double weight,
                             ShapeTerms<Dim>& terms) const = 0;
  /// Adds weight * d2J at the current shape.
  /// @throws UsageError  the energy has no second derivative in this form
  virtual void differentiate_twice(const fem::Curvature& curvature, double weight,
                                   SecondDerivative<Dim>& second) const = 0;
  /// Adds weight * F(x) at points inside the current shape, with F the density of the domain part:
  /// without a small ball B about x, J changes by -F(x) |B| and what its boundary costs. So F is
  /// the topological derivative, up to its sign. Boundary energies have none.
  /// @param points  (n, Dim);  @param density  (n)
  virtual void add_density(const Points<Dim>& points, double weight,
                           Eigen::VectorXd& density) const {
    (void)points, (void)weight, (void)density;
  }
};

}  // namespace surf::energy
