// A multigrid cycle for screened Poisson problems on domains that cut a grid's cells. Private to
// volume/*.cpp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libsurf/volume/detail/cut_matrix.h"

namespace surf::volume {

/// V-cycle for M + mu K. The trilinear functions of a coarse level are among those of the next
/// finer one, and moments of coarse cells are sums of those of their children, so that every level
/// is Galerkin's, cut cells included. Axes with long cells are coarsened later than the others;
/// where cells are as long as sqrt(mu), M rules and there is no coarser level.
///
/// Smoother: Chebyshev's iteration with rows scaled by the sum of their |entries|, the same before
/// and after, so that the cycle is symmetric and positive definite: a preconditioner for CG.
class Multigrid {
 public:
  Multigrid(DomainCells cells, const Eigen::Matrix3d& index_to_world, double mu);

  const CutMatrix& matrix() const { return levels_.front().matrix; }
  /// z = B r
  void precondition(const Values& r, Values& z);

 private:
  struct Level {
    CutMatrix matrix;
    std::array<int, 3> factor;  // to the next coarser level
    Values rhs, solution, residual, step;

    void allocate(bool is_finest);
  };

  void cycle(std::size_t level, const Values& rhs, Values& solution);

  std::vector<Level> levels_;
};

}  // namespace surf::volume
