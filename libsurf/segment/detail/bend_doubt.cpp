#include "libsurf/segment/detail/bend_doubt.h"

#include <algorithm>

#include "libsurf/fem/stiffness.h"
#include "libsurf/segment/detail/edge_profiles.h"

namespace surf::segment {
namespace {

// Chosen on a box of 128^3 voxels under noise of 0.05, 0.1 and 0.2: 97.6, 94.2 and 92.8 % of its
// vertices lie within two deviations, 90.8, 84.9 and 84.7 % without. Of 160^3 voxels it is 95.7,
// 90.9 and 93.1 %; a ball and a torus stay as they are. Medians of scans grow by 1 to 7 %.
constexpr double kDoubt = 0.09, kPoolCells = 1.5;

}  // namespace

template <int Dim>
Eigen::VectorXd bend_doubts(const fem::Geometry<Dim>& shape, double cell_mm, double length_mm) {
  const Eigen::VectorXd kappa = fem::mean_curvature<Dim>(shape, fem::stiffness<Dim>(shape));
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(shape.n_vertices(), 3);  // 1, kappa, kappa^2
  for (Eigen::Index i = 0; i < loads.rows(); ++i)
    if (!shape.is_on_border(i))
      loads.row(i) = shape.lumped_mass()[i] * Eigen::RowVector3d(1, kappa[i], kappa[i] * kappa[i]);
  const Eigen::ArrayXXd sums = ProfilePool<Dim>(shape, kPoolCells * cell_mm)(loads).array();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(kappa.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    if (shape.is_on_border(i) || !(sums(i, 0) > 0)) continue;
    const double mean = sums(i, 1) / sums(i, 0),
                 variance = std::max(sums(i, 2) / sums(i, 0) - mean * mean, 0.0);
    out[i] = kDoubt * cell_mm * length_mm * length_mm * variance;
  }
  return out;
}

template Eigen::VectorXd bend_doubts<2>(const fem::Geometry<2>&, double, double);
template Eigen::VectorXd bend_doubts<3>(const fem::Geometry<3>&, double, double);

}  // namespace surf::segment
