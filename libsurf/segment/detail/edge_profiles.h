// Blurred steps across a shape: how its edges look like from place to place.
#pragma once

#include "libsurf/base/sparse_cholesky.h"
#include "libsurf/segment/detail/edge_cells.h"

namespace surf::segment {

/// I(d) = (inside + outside) / 2 + (outside - inside) / 2 erf((d - place) / (sqrt(2) width)) at the
/// signed distance d from the shape, of each vertex with what lies round it, (n).
struct EdgeProfiles {
  Eigen::VectorXd inside, outside;  ///< levels [intensity]
  Eigen::VectorXd width_mm;         ///< deviation of the blur
  Eigen::VectorXd place_mm;
  Eigen::VectorXd noise;      ///< deviation of the cells from it [intensity], > 0
  Eigen::VectorXd explained;  ///< share of the profile's variance that the step explains
  Eigen::VectorXd n_cells;    ///< that it was fitted to
  Eigen::VectorXd misfit;     ///< robust deviation of the bins' means from it [intensity]
};

/// What the fit takes for granted.
struct ProfileOptions {
  double reach_mm = 1;  ///< of the cells
  double width_mm = 1;  ///< expected, within a factor of
  double width_range = 1.5;
  double least_noise = 0;
};

/// Sums along a shape: of loads at its vertices, by (M + pool^2 A)^-1, times the area or length
/// that the kernel counts.
template <int Dim>
class ProfilePool {
 public:
  /// @param pool_mm  loads up to about twice as far along the shape count
  ProfilePool(const fem::Geometry<Dim>& geometry, double pool_mm);
  /// (n, columns); sums of what is positive can fall below 0 by little.
  Eigen::MatrixXd operator()(const Eigen::MatrixXd& loads) const {
    return area_mm_ * factor_.solve(loads);
  }

 private:
  SparseCholesky factor_;
  double area_mm_;
};

/// Fits to the cells' means at distances half a cell apart, pooled along the shape, by Ceres'
/// TinySolver: least squares, robust (pseudo-Huber), the width as probable as a log-normal number.
/// @param moved_mm  by which the vertices have moved along their normals, (n): distances count
///                  from there
/// @param misfit    of the fit before, by which bins are weighted; empty, or 0 at a vertex = that
/// of a
///                  first fit
template <int Dim>
EdgeProfiles fit_edge_profiles(const fem::Geometry<Dim>& geometry, const EdgeCells<Dim>& cells,
                               const Eigen::VectorXd& moved_mm, const ProfilePool<Dim>& pool,
                               const ProfileOptions& options, const Eigen::VectorXd& misfit = {});

/// Signed distance of a cell to its element after the vertices moved [mm].
template <int Dim>
double distance_after(const EdgeCell<Dim>& cell, const Elements<Dim>& T,
                      const Eigen::VectorXd& moved_mm) {
  double out = cell.distance_mm;
  for (int i = 0; i < Dim; ++i) out -= cell.reach[i] * moved_mm[T(cell.element, i)];
  return out;
}

/// The value that the profiles expect at a distance from the moved shape, and its derivative by it.
struct ExpectedValue {
  double value = 0, slope = 0, noise = 0;
};
template <int Dim>
ExpectedValue expected_value(const EdgeProfiles& profiles, const EdgeCell<Dim>& cell,
                             const Elements<Dim>& T, double distance_mm);

/// Whether the cells beside the elements of each vertex show the step that is fitted to all cells
/// some way round it: where an edge ends those of the edge would speak for what is beyond.
/// A vertex alone among others without is noise; one with few cells on either side has it.
/// @param u  moves of the vertices along their normals, (n) [mm]
template <int Dim>
std::vector<char> have_own_steps(const fem::Geometry<Dim>& geometry, const EdgeCells<Dim>& cells,
                                 const EdgeProfiles& profiles, const Eigen::VectorXd& u);

}  // namespace surf::segment
