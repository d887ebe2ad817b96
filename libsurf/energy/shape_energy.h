// What every shape energy offers to the flows.
#pragma once

#include <string>

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
        beta(Eigen::VectorXd::Zero(shape.n_vertices())) {}

  /// dJ(Gamma; phi_i e_k): the exact derivative of the discrete J (with its quadrature) with
  /// respect to vertex i, (n, Dim). So the step control sees the energy whose derivative the
  /// flow follows. Its normal part converges to the weak form <G, phi_i> of the
  /// shape gradient G = g kappa + f (1.13): derivative_i . n_i -> (M_g K + f)_i of (3.53).
  Points<Dim> derivative;
  /// Coefficient g of the curvature in G at the vertices, (n); the implicit part of (3.54).
  Eigen::VectorXd g;
  /// Weights of the scalar product <alpha grad V, grad W> + <beta V, W> (3.8) from the second
  /// derivative: alpha per element (m), beta per vertex (n). beta may be negative here; the
  /// positive part is taken of the sum of all terms.
  Eigen::VectorXd alpha, beta;
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
  /// J at the current shape.
  virtual double value() const = 0;
  /// J at `moved`, which has the topology of the current shape. Only remembered by accept.
  virtual double try_move(const fem::Geometry<Dim>& moved) = 0;
  /// Takes the shape of the last try_move as current.
  virtual void accept() = 0;
  /// Takes `shape`, another mesh of (nearly) the same domain, as current: boundary integrals
  /// are computed anew, domain integrals are kept.
  virtual void remesh(const fem::Geometry<Dim>& shape) = 0;
  /// Takes `shape`, whose domain has been changed by topology surgery, as current. What the
  /// derivative depends on is computed anew; J may be off by a constant until the next reset.
  virtual void rebuild(const fem::Geometry<Dim>& shape) { reset(shape); }
  /// Adds weight * (first derivative, g, alpha, beta) at the current shape.
  /// @param curvature  mean curvature at the vertices, (n), for alpha and beta
  virtual void differentiate(const Eigen::VectorXd& curvature, double weight,
                             ShapeTerms<Dim>& terms) const = 0;
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
