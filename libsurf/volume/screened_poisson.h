// Screened Poisson problems with the natural boundary condition on domains bounded by surfaces.
#pragma once

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
};

/// -mu Lap u + u = I in Omega, d_nu u = 0 on its boundary (5.4), Omega a part of a grid's box: the
/// minimiser of J(u) = 1/2 int_Omega (u - I)^2 + mu |grad u|^2 among the trilinear functions on the
/// grid, with I trilinear too.
///
/// Integrals over cut cells are exact, so the natural boundary condition holds at the surface
/// itself and not at the voxels next to it, whatever the grid's affine. Error O(h^2) in L2, O(h) in
/// H1. The minimum is a differentiable function of the surface, whose derivative is
/// 1/2 int_Gamma ((u - I)^2 + mu |grad u|^2) V dS exactly: u is extended by its own functions.
///
/// CG with one multigrid cycle as preconditioner; 16 8-byte values per node at most.
class ScreenedPoisson {
 public:
  /// @param cells  of Omega on `grid`
  /// @param I      at the nodes of the grid, i fastest; kept by the caller
  ScreenedPoisson(std::shared_ptr<const DomainCells> cells, const Grid& grid, double mu,
                  std::span<const double> I, const ScreenedPoissonOptions& options = {});
  ~ScreenedPoisson();
  ScreenedPoisson(ScreenedPoisson&&) noexcept;

  /// Takes the values of another problem's solution as a start.
  /// @param shift  node (i, j, k) here is node (i, j, k) + shift there
  void start_from(const ScreenedPoisson& other, const std::array<int, 3>& shift);
  /// Minimises. Returns the number of iterations.
  int solve();
  /// J(u)
  double energy() const;

  /// u at the corners of a cell, x fastest. Corners whose functions vanish on Omega get the mean of
  /// their neighbours in the cell.
  std::array<double, 8> corner_values(int i, int j, int k) const;
  /// u at a node where there is a part of Omega in one of its cells, else I.
  double node_value(int i, int j, int k) const;
  bool is_active(int i, int j, int k) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf::volume
