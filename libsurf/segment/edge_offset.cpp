#include "libsurf/segment/edge_offset.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {

template <int Dim>
Points<Dim> moved_to_edge(const Simplices<Dim>& surface, const Field<Dim>& H, double limit_mm) {
  const fem::Geometry<Dim> shape(surface.points, surface.elements);
  const SparseMatrix A = fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const Eigen::VectorXd kappa = fem::mean_curvature<Dim>(shape, A);
  Samples<Dim> samples;
  H.sample(surface.points, Derivatives::kSecond, samples);
  Points<Dim> normals = shape.nodal_normals();
  Eigen::VectorXd delta(shape.n_vertices());
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
    normals.row(i).normalize();
    const Vector<Dim> nu = normals.row(i);
    const Eigen::Map<const Eigen::Matrix<double, Dim, Dim>> hessian(samples.hessian.row(i).data());
    const double second = nu.dot(hessian * nu);
    const double offset = second > 0 ? kappa[i] * samples.value[i] / second : 0;
    delta[i] = std::clamp(offset, -limit_mm, limit_mm);
  }
  const double element = shape.measure() / double(shape.n_elements());
  const double edge_squared = Dim == 3 ? 4 / std::sqrt(3.0) * element : element * element;
  SparseMatrix smoothing = 9 * edge_squared * A;
  for (Eigen::Index i = 0; i < delta.size(); ++i)
    smoothing.coeffRef(i, i) += shape.lumped_mass()[i];
  Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> solver(smoothing);
  delta = solver.solve(shape.lumped_mass().cwiseProduct(delta)).eval();
  return surface.points + delta.asDiagonal() * normals;
}

template Points<2> moved_to_edge<2>(const Segments&, const Field<2>&, double);
template Points<3> moved_to_edge<3>(const Triangles&, const Field<3>&, double);

}  // namespace surf::segment
