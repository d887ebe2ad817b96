#include "libsurf/segment/edge_offset.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {

Points<3> moved_to_edge(const Triangles& surface, const Field<3>& H, double limit_mm) {
  const fem::Geometry<3> shape(surface.points, surface.elements);
  const SparseMatrix A = fem::stiffness<3>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const Eigen::VectorXd kappa = fem::mean_curvature<3>(shape, A);
  Samples<3> samples;
  H.sample(surface.points, Derivatives::kSecond, samples);
  Points<3> normals = shape.nodal_normals();
  Eigen::VectorXd delta(shape.n_vertices());
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
    normals.row(i).normalize();
    const Vector<3> nu = normals.row(i);
    const Eigen::Map<const Eigen::Matrix3d> hessian(samples.hessian.row(i).data());
    const double second = nu.dot(hessian * nu);
    const double offset = second > 0 ? kappa[i] * samples.value[i] / second : 0;
    delta[i] = std::clamp(offset, -limit_mm, limit_mm);
  }
  const double edge_squared = 4 / std::sqrt(3.0) * shape.measure() / double(shape.n_elements());
  SparseMatrix smoothing = 9 * edge_squared * A;
  for (Eigen::Index i = 0; i < delta.size(); ++i)
    smoothing.coeffRef(i, i) += shape.lumped_mass()[i];
  Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> solver(smoothing);
  delta = solver.solve(shape.lumped_mass().cwiseProduct(delta)).eval();
  return surface.points + delta.asDiagonal() * normals;
}

}  // namespace surf::segment
