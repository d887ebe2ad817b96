#include "libsurf/segment/detail/edge_offset.h"

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {

template <int Dim>
Points<Dim> moved_to_edge(const Simplices<Dim>& shape, energy::ShapeEnergy<Dim>& energy,
                          double blur_mm, double limit_mm) {
  const fem::Geometry<Dim> geometry(shape.points, shape.elements);
  const SparseMatrix A =
      fem::stiffness<Dim>(geometry, Eigen::VectorXd::Ones(geometry.n_elements()));
  const fem::Curvature curvature = fem::curvature<Dim>(geometry, A);
  energy.reset(geometry);
  energy::ShapeTerms<Dim> terms(geometry);
  energy.differentiate(curvature, 1, terms);
  Points<Dim> normals = geometry.nodal_normals();
  normals.rowwise().normalize();
  Eigen::VectorXd delta(geometry.n_vertices());
  for (Eigen::Index i = 0; i < delta.size(); ++i) {
    const double kappa = curvature.mean[i];
    const double offset =
        terms.beta[i] > 0 ? kappa * (terms.g[i] / terms.beta[i] + blur_mm * blur_mm / 2) : 0;
    delta[i] = std::clamp(offset, -limit_mm, limit_mm);
  }
  const double element = geometry.measure() / double(geometry.n_elements());
  const double edge_squared = Dim == 3 ? 4 / std::sqrt(3.0) * element : element * element;
  SparseMatrix smoothing = 9 * edge_squared * A;
  for (Eigen::Index i = 0; i < delta.size(); ++i)
    smoothing.coeffRef(i, i) += geometry.lumped_mass()[i];
  Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> solver(smoothing);
  delta = solver.solve(geometry.lumped_mass().cwiseProduct(delta)).eval();
  return shape.points + delta.asDiagonal() * normals;
}

template Points<2> moved_to_edge<2>(const Segments&, energy::ShapeEnergy<2>&, double, double);
template Points<3> moved_to_edge<3>(const Triangles&, energy::ShapeEnergy<3>&, double, double);

}  // namespace surf::segment
