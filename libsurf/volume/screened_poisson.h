// Screened Poisson problems with the natural boundary condition on domains bounded by surfaces.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "libsurf/volume/cut_cells.h"
#include "libsurf/volume/tiled_field.h"

namespace surf::volume {

struct ScreenedPoissonOptions {
  /// CG stops when the residual has fallen to this share of that of u = I, in the norm of the
  /// scaled rows. The energy's relative error is about its square.
  double tolerance = 1e-5;
  int max_iterations = 500;
  /// Share of the integrals over cut cells that is taken from the cell's mean, in (0, 1]: with
  /// none, cells of which the domain has next to nothing make CG need 50 to 180 iterations in place
  /// of 7.
  double blend = 0.1;
};

/// 1/2 ((u - I)^2 + mu |grad u|^2) of one side of a surface at points of a cell: what J changes by
/// per volume that the side wins there.
class CellDensity {
 public:
  /// @param x  in the cell, [0, 1]^3
  double operator()(const Eigen::Vector3d& x) const;
  /// u - I there.
  double difference(const Eigen::Vector3d& x) const;
  /// The derivatives of u along the axes of the grid there [1 / spacing].
  Eigen::Vector3d slope(const Eigen::Vector3d& x) const;
  /// The derivative of the density by u at the corners of the cell, x fastest: (u - I) phi_a +
  /// mu grad u . grad phi_a.
  Eigen::Matrix<double, 8, 1> by_corner(const Eigen::Vector3d& x) const;

 private:
  friend class ScreenedPoisson;
  std::array<double, 8> u_, e_;
  Eigen::Matrix3d metric_;  // times mu
  Eigen::Matrix<double, 8, 1> constant_by_corner_;
  double pointwise_ = 1, constant_ = 0;
};

/// -mu Lap u + u = I in Omega, d_nu u = 0 on its boundary (5.4), Omega a part of a grid's box: the
/// minimiser of J(u) = 1/2 int_Omega (u - I)^2 + mu |grad u|^2 among the trilinear functions on the
/// grid, with I trilinear too.
///
/// Integrals over cut cells are exact but for the share `blend`, so the natural boundary condition
/// holds at the surface itself and not at the voxels next to it, whatever the grid's affine. Error
/// O(h^2) in L2, O(h) in H1. The minimum is a differentiable function of the surface, and its
/// derivative is the integral of `density` times V, exactly.
///
/// CG with one multigrid cycle as preconditioner: about 7 iterations for six digits whatever mu
/// and the grid are. Solving takes some 14 values of 8 bytes per node, the solution one.
class ScreenedPoisson {
 public:
  /// Solves.
  /// @param cells  of Omega on `grid`
  /// @param I      at the nodes of the grid, i fastest; kept by the caller
  /// @param start  another solution to start from, on a grid where node (i, j, k) + `shift` is node
  ///               (i, j, k) here
  ScreenedPoisson(const DomainCells& cells, const Grid& grid, double mu, std::span<const double> I,
                  const ScreenedPoissonOptions& options = {},
                  const ScreenedPoisson* start = nullptr, const std::array<int, 3>& shift = {});
  ~ScreenedPoisson();
  ScreenedPoisson(ScreenedPoisson&&) noexcept;
  ScreenedPoisson& operator=(ScreenedPoisson&&) noexcept;

  /// J(u)
  double energy() const;
  int n_iterations() const;
  /// Whether the residual fell to the tolerance; if not, a warning was logged too.
  bool has_converged() const;

  /// u at the corners of a cell, x fastest. Corners whose functions vanish on Omega get the mean of
  /// their neighbours in the cell.
  std::array<double, 8> corner_values(int i, int j, int k) const;
  CellDensity density(int i, int j, int k) const;
  /// u at a node where there is a part of Omega in one of its cells, else I.
  double node_value(int i, int j, int k) const;
  bool is_active(int i, int j, int k) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The inverse of the problem's matrix: v with <mu grad v, grad phi> + <v, phi> = load(phi) for all
/// trilinear phi, for one load after another.
class ScreenedPoissonInverse {
 public:
  /// @param cells  of Omega on `grid`
  ScreenedPoissonInverse(const DomainCells& cells, const Grid& grid, double mu,
                         const ScreenedPoissonOptions& options);
  ~ScreenedPoissonInverse();
  ScreenedPoissonInverse(ScreenedPoissonInverse&&) noexcept;

  /// @param load  at the nodes of the grid, i fastest; what nodes whose functions vanish on Omega
  ///              have is not heeded
  /// @return      v at the nodes, 0 at those
  Eigen::VectorXd operator()(const Eigen::VectorXd& load) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
