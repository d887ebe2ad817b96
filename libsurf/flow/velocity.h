// The velocity systems of chapter 3: explicit (3.53) and semi-implicit (3.54).
#pragma once

#include <memory>
#include <string>

#include "libsurf/energy/shape_energy.h"
#include "libsurf/fem/geometry.h"

namespace surf::flow {

enum class ScalarProduct {
  kL2,  ///< <V, W>: the usual gradient flow (3.7)
  /// <alpha grad V, grad W> + <beta V, W> (3.8), alpha and beta from the second derivative;
  /// energies of fourth order add <c Lap V, Lap W>.
  kH1,
  /// <grad p, grad q> with -Lap p = V, -Lap q = W: V = Lap (g kappa + f), (3.10) with its signs
  /// corrected. Of the length or area this is surface diffusion, V = Lap kappa. Keeps the content.
  kHMinus1
};
/// "l2", "h1", "h-1"
std::string to_string(ScalarProduct product);
enum class Scheme { kExplicit, kSemiImplicit };

struct VelocityOptions {
  ScalarProduct product = ScalarProduct::kH1;
  Scheme scheme = Scheme::kExplicit;
  /// H1: beta is at least floor * g_max / r^2 with g_max the largest curvature coefficient and
  /// r the shape's own radius. The thesis' eps = 100 (5.1) belongs to lengths of order 1.
  double beta_floor = 100;
  /// Relative residual at which the iterative solvers of surfaces stop. Curves, H^-1 and energies
  /// of fourth order are solved directly.
  double solver_tolerance = 1e-8;
  /// Only velocities that keep the content to first order: b(V, W) = -dJ(W) - lambda dC(W) for all
  /// W, with the multiplier lambda for which dC(V) = 0.
  bool keeps_content = false;

  std::string error() const;  ///< empty if valid
};

/// One descent direction.
template <int Dim>
struct Velocity {
  Eigen::VectorXd normal;       ///< V at the vertices, (n)
  Points<Dim> vector;           ///< V n_i with the nodal normals, (n, Dim): last line of (3.53)
  double shape_derivative = 0;  ///< dJ(Gamma; V) <= 0, of the discrete J
  double norm_squared = 0;      ///< b(V, V) of the scalar product in use
  /// With keeps_content: the multiplier, dJ + lambda dC = 0 where the constrained flow ends, and
  /// the velocity along which the content is corrected, (n).
  double multiplier = 0;
  Eigen::VectorXd content_direction;
};

/// The matrix of the weighted H1 product: A_alpha + M_beta + A M^-1 diag(c) A with the positive
/// parts of the weights and beta at least its floor. Symmetric positive definite.
/// @param A  fem::stiffness(shape, 1);  @param beta_floor  VelocityOptions::beta_floor
template <int Dim>
SparseMatrix h1_product(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                        const SparseMatrix& A, double beta_floor);

/// Computes velocities for one shape: matrices and factorisation are kept while the time step
/// of the semi-implicit scheme is searched.
///
/// Right-hand side: -dJ(Gamma; phi_i n_i), the exact discrete derivative, in place of
/// -(M_g K + f) of (3.53), to which it converges. Masses are lumped.
///
/// Explicit: (A_alpha + M_beta) V = -r. Semi-implicit, the Schur complement (3.61) with
/// lumped masses and W = M_g M^-1, S = N^T M^-1 A M^-1 N: (tau W S + A_alpha + M_beta) V = -r.
/// L2: in the variable Y = W^(-1/2) V this is the symmetric
/// (M + tau W^(1/2) S W^(1/2)) Y = -W^(-1/2) r, which stays well scaled where g -> 0 at an
/// edge ((3.63) divides by g). H1: nonsymmetric, by BiCGSTAB. Without a curvature term (g <= 0)
/// both are the explicit scheme.
///
/// Energies of fourth order (terms.bilaplacian = c > 0), with z = -c Lap V, and H^-1, with -Lap p =
/// V, are mixed systems in which only first derivatives of V, z and p appear. With K = A M^-1
/// diag(c) A, z eliminated exactly, and a = S_alpha + K the principal part of the second
/// derivative,
///   L2   (M + tau a) V = -r
///   H1   (A_alpha + M_beta + K + tau a) V = -r
///   H^-1  tau a V + M p = -r,  M V - A p = 0,
/// tau = 0 if explicit: all symmetric, so that V descends at any tau, and solved by LDL^T. In H^-1,
/// M has the entries dC(phi_i n_i) = m_i |n_i|^2; so dC(V) = 0, exactly.
template <int Dim>
class VelocitySystem {
 public:
  /// @param shape, terms  must outlive this object
  /// @param A  stiffness(shape, 1)
  VelocitySystem(const fem::Geometry<Dim>& shape, const energy::ShapeTerms<Dim>& terms,
                 const SparseMatrix& A, const VelocityOptions& options);
  ~VelocitySystem();

  /// True if the velocity depends on the time step (semi-implicit).
  bool depends_on_step() const;
  /// @param tau  time step, used by the semi-implicit scheme only
  Velocity<Dim> solve(double tau) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::flow
