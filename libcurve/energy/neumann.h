// The Neumann problems of the Mumford-Shah model on both sides of curves, by P1 elements.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "libcurve/mesh/domain_mesh.h"
#include "libsurf/base/field.h"

namespace surf::curve {

struct NeumannOptions {
  double mu = 1;  ///< [mm^2], > 0
  /// Longest edge of the parts of a triangle over which I is integrated [mm], > 0: a pixel. At most
  /// 64 of them lie along an edge.
  double spacing_mm = 1;
  /// I is replaced by (I - offset) / scale.
  double offset = 0, scale = 1;
  double tolerance = 1e-10;  ///< of the relative residual
};

/// Unknowns: a node on the curves has one on each side.
struct Unknowns {
  /// Number of the unknown of a node outside and inside, -1 where it has none: (n, 2).
  Eigen::Matrix<int, Eigen::Dynamic, 2, Eigen::RowMajor> of_node;
  int size = 0;
};

Unknowns unknowns(const DomainMesh& mesh);

/// What of I is integrated over each triangle, (m): (I - offset) / scale here.
struct ImageIntegrals {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> loads;  ///< <I, phi_i>, (m, 3)
  /// ||I - Pi_h I||^2, Pi_h I the linear interpolant of the corners' values: eta_T of Alg. 8.
  Eigen::VectorXd errors;
  std::vector<int> parts;  ///< of each edge, on which they were integrated
};

/// @param last_mesh, last  integrals that are known: those of triangles with the same corners are
///                         copied; may be null
ImageIntegrals image_integrals(const DomainMesh& mesh, const Field<2>& I,
                               const NeumannOptions& options, const DomainMesh* last_mesh = nullptr,
                               const ImageIntegrals* last = nullptr);

/// -mu Lap u_i + u_i = I in Omega_i, d_nu u_i = 0 on its boundary, i = 1, 2: thesis (2.46), in the
/// weak form <mu grad u_i, grad phi> + <u_i, phi> = <I, phi> (2.48) on the P1 functions of each
/// domain. Masses are consistent. Loads are integrated on parts of each triangle that are no longer
/// than the spacing: with that of a pixel the mesh may be as coarse as u_i allows, however I
/// varies.
class Neumann {
 public:
  /// Solves.
  /// @param integrals  of the mesh
  /// @param start      (size) to begin the iteration with; empty: zero
  Neumann(DomainMesh mesh, ImageIntegrals integrals, std::shared_ptr<const Field<2>> I,
          const NeumannOptions& options, const Eigen::VectorXd& start = {});
  /// The same triangles with other nodes, solved anew from this solution; the quadrature's parts
  /// are those of the triangles as they were, so that energy() is a smooth function of the nodes.
  Neumann moved_to(const Points<2>& points) const;

  const DomainMesh& mesh() const { return mesh_; }
  const Unknowns& unknowns() const { return unknowns_; }
  /// u at the unknowns, (size).
  const Eigen::VectorXd& u() const { return u_; }
  const ImageIntegrals& integrals() const { return integrals_; }
  int n_iterations() const { return n_iterations_; }
  const NeumannOptions& options() const { return options_; }
  /// <mu grad phi_a, grad phi_b> + <phi_a, phi_b> of all unknowns: symmetric positive definite.
  Eigen::SparseMatrix<double> matrix() const;
  /// I as the problem sees it, (I - offset) / scale, at points: (n).
  Eigen::VectorXd intensity(const Points<2>& points) const;

  /// min_u sum_i 1/2 int_{Omega_i} (mu |grad u_i|^2 + u_i^2) - int_{Omega_i} I u_i: the first term
  /// of (5.4) less 1/2 int I^2 over the box, which no curve changes. Quadratic in the error of u.
  double energy() const { return energy_; }
  /// Derivative of energy() with respect to the nodes, exact: (n, 2). As u minimises, it is the
  /// partial derivative at fixed coefficients of u.
  /// @param asked  nodes for which it is wanted, one flag each; others have it in part. Empty: all.
  Points<2> gradient(const std::vector<char>& asked = {}) const;

  /// Value of u_i at a node of the closure of Omega_i.
  double value(int node, bool is_inside) const { return u_[unknowns_.of_node(node, is_inside)]; }
  /// Means of u inside and outside, {outside, inside}, which are those of I.
  std::array<double, 2> means() const;

 private:
  Neumann() = default;
  void solve(const Eigen::VectorXd& start);
  std::array<int, 3> unknowns_of(Eigen::Index t) const;

  DomainMesh mesh_;
  std::shared_ptr<const Field<2>> I_;
  NeumannOptions options_;
  Unknowns unknowns_;
  ImageIntegrals integrals_;
  Eigen::VectorXd u_;
  double energy_ = 0;
  int n_iterations_ = 0;
};

}  // namespace surf::curve
