#include "libsurf/fem/curvature.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "libsurf/fem/stiffness.h"

namespace surf::fem {
namespace {

/// 2 pi minus the angles at each vertex.
Eigen::VectorXd angle_defects(const Geometry<3>& shape) {
  Eigen::VectorXd defect = Eigen::VectorXd::Constant(shape.n_vertices(), 2 * std::numbers::pi);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    for (int i = 0; i < 3; ++i) {
      const int at = shape.elements()(t, i);
      const Vector<3> a =
          shape.points().row(shape.elements()(t, (i + 1) % 3)) - shape.points().row(at);
      const Vector<3> b =
          shape.points().row(shape.elements()(t, (i + 2) % 3)) - shape.points().row(at);
      defect[at] -= std::atan2(a.cross(b).norm(), a.dot(b));
    }
  return defect;
}

}  // namespace

template <int Dim>
Curvature curvature(const Geometry<Dim>& shape, const SparseMatrix& A) {
  Curvature out;
  out.mean = mean_curvature<Dim>(shape, A);
  out.square_sum = out.mean.cwiseAbs2();
  if constexpr (Dim == 3)
    out.square_sum -= 2 * angle_defects(shape).cwiseQuotient(shape.lumped_mass());
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
    if (shape.is_on_border(i)) out.mean[i] = out.square_sum[i] = 0;
  return out;
}

template <int Dim>
std::vector<Eigen::Matrix<double, Dim, Dim>> shape_operators(const Geometry<Dim>& shape) {
  using Matrix = Eigen::Matrix<double, Dim, Dim>;
  const Points<Dim> normals = shape.nodal_normals().rowwise().normalized();
  std::vector<Matrix> out(shape.n_elements());
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    Matrix gradient = Matrix::Zero();
    for (int i = 0; i < Dim; ++i)
      gradient += normals.row(shape.elements()(t, i)).transpose() * shape.basis_gradients(t).row(i);
    const Vector<Dim> nu = shape.normals().row(t);
    const Matrix tangential = gradient - nu * (nu.transpose() * gradient);
    out[t] = (tangential + tangential.transpose()) / 2;
  }
  return out;
}

template Curvature curvature<2>(const Geometry<2>&, const SparseMatrix&);
template Curvature curvature<3>(const Geometry<3>&, const SparseMatrix&);
template std::vector<Eigen::Matrix<double, 2, 2>> shape_operators<2>(const Geometry<2>&);
template std::vector<Eigen::Matrix<double, 3, 3>> shape_operators<3>(const Geometry<3>&);

}  // namespace surf::fem
