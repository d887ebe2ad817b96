#include "libsurf/energy/detail/density_terms.h"

#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/fem/quadrature.h"

namespace surf::energy {
namespace {

template <int Dim>
using Matrix = Eigen::Matrix<double, Dim, Dim, Eigen::RowMajor>;

template <int Dim>
Eigen::Map<const Matrix<Dim>> matrix_at(const typename DensitySamples<Dim>::Hessians& hessians,
                                        Eigen::Index at) {
  return Eigen::Map<const Matrix<Dim>>(hessians.row(at).data());
}

}  // namespace

template <int Dim>
DensitySamples<Dim> sample_boundary(const AnisotropicDensity<Dim>& H,
                                    const fem::Geometry<Dim>& shape, int quadrature_order,
                                    Derivatives order) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  Points<Dim> normals(shape.n_elements() * rule.size(), Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    normals.middleRows(t * rule.size(), rule.size()).rowwise() = shape.normals().row(t);
  DensitySamples<Dim> samples;
  H.sample(fem::quadrature_points<Dim>(shape.points(), shape.elements(), rule.points), normals,
           order, samples);
  return samples;
}

template <int Dim>
double boundary_sum(const Eigen::VectorXd& value, const fem::Geometry<Dim>& shape,
                    int quadrature_order) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  double sum = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    sum +=
        shape.charged_measures()[t] * rule.weights.dot(value.segment(t * rule.size(), rule.size()));
  return sum;
}

template <int Dim>
Points<Dim> boundary_derivative(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                                int quadrature_order) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  const Elements<Dim>& T = shape.elements();
  Points<Dim> out = Points<Dim>::Zero(shape.n_vertices(), Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const double measure = shape.charged_measures()[t];
    const bool is_stretched = shape.place(t) == fem::Place::kFree;
    double mean_H = 0;
    Vector<Dim> mean_H_y = Vector<Dim>::Zero();
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      mean_H += rule.weights[q] * H.value[at];
      mean_H_y += rule.weights[q] * H.dy.row(at);
      for (int i = 0; i < Dim; ++i)
        out.row(T(t, i)) += measure * rule.weights[q] * rule.points(q, i) * H.dx.row(at);
    }
    for (int i = 0; i < Dim; ++i) {
      const auto gradient = shape.basis_gradients(t).row(i);
      if (is_stretched) out.row(T(t, i)) += measure * mean_H * gradient;
      out.row(T(t, i)) -= measure * gradient.dot(mean_H_y) * shape.normals().row(t);
    }
  }
  return out;
}

template <int Dim>
Eigen::VectorXd boundary_load(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                              int quadrature_order) {
  return boundary_derivative<Dim>(H, shape, quadrature_order)
      .cwiseProduct(shape.directions())
      .rowwise()
      .sum();
}

template <int Dim>
void add_boundary_terms(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                        int quadrature_order, const Eigen::VectorXd& curvature, double weight,
                        ShapeTerms<Dim>& terms) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  const Elements<Dim>& T = shape.elements();
  terms.derivative += weight * boundary_derivative<Dim>(H, shape, quadrature_order);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    if (shape.place(t) == fem::Place::kBorder) continue;
    const Vector<Dim> nu = shape.normals().row(t);
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const auto H_yy = matrix_at<Dim>(H.dyy, at);
      const double kappa = at_point<Dim>(curvature, shape, t, rule.points.row(q));
      const double beta = nu.dot(matrix_at<Dim>(H.dxx, at) * nu) + 2 * kappa * H.dx.row(at).dot(nu);
      terms.alpha[t] +=
          weight * rule.weights[q] *
          (H.value[at] - H.dy.row(at).dot(nu) + (H_yy.trace() - nu.dot(H_yy * nu)) / (Dim - 1));
      for (int i = 0; i < Dim; ++i) {
        const double w = weight * rule.weights[q] * shape.measures()[t] * rule.points(q, i) /
                         shape.lumped_mass()[T(t, i)];
        terms.beta[T(t, i)] += w * beta;
        terms.g[T(t, i)] += w * H.value[at];
      }
    }
  }
}

template <int Dim>
void add_boundary_second(const DensitySamples<Dim>& H, const fem::Geometry<Dim>& shape,
                         int quadrature_order, const fem::Curvature& curvature, double weight,
                         SparseMatrix& second) {
  const auto& rule = fem::quadrature<Dim>(quadrature_order);
  const Eigen::VectorXd twice_gauss = curvature.mean.cwiseAbs2() - curvature.square_sum;
  const auto S = fem::shape_operators<Dim>(shape);
  add_element_matrices<Dim>(shape, weight, second, [&](Eigen::Index t) {
    const Vector<Dim> nu = shape.normals().row(t);
    const Matrix<Dim> gradients = shape.basis_gradients(t);
    Matrix<Dim> local = Matrix<Dim>::Zero();
    for (Eigen::Index q = 0; q < rule.size(); ++q) {
      const Eigen::Index at = t * rule.size() + q;
      const Vector<Dim> phi = rule.points.row(q), H_x = H.dx.row(at), H_y = H.dy.row(at);
      const double kappa = at_point<Dim>(curvature.mean, shape, t, phi);
      const double mass = nu.dot(matrix_at<Dim>(H.dxx, at) * nu) + 2 * kappa * H_x.dot(nu) +
                          at_point<Dim>(twice_gauss, shape, t, phi) * H.value[at];
      const Vector<Dim> mixed =
          kappa * H_y + matrix_at<Dim>(H.dxy, at).transpose() * nu - S[t] * H_y;
      Matrix<Dim> stiffness = matrix_at<Dim>(H.dyy, at);
      stiffness.diagonal().array() += H.value[at] - H_y.dot(nu);
      const Matrix<Dim> cross = phi * (gradients * mixed).transpose();
      local += rule.weights[q] * (gradients * stiffness * gradients.transpose() +
                                  mass * phi * phi.transpose() - cross - cross.transpose());
    }
    return Eigen::Matrix<double, Dim, Dim>(shape.measures()[t] * local);
  });
}

#define SURF_INSTANTIATE(Dim)                                                                     \
  template DensitySamples<Dim> sample_boundary<Dim>(const AnisotropicDensity<Dim>&,               \
                                                    const fem::Geometry<Dim>&, int, Derivatives); \
  template double boundary_sum<Dim>(const Eigen::VectorXd&, const fem::Geometry<Dim>&, int);      \
  template Points<Dim> boundary_derivative<Dim>(const DensitySamples<Dim>&,                       \
                                                const fem::Geometry<Dim>&, int);                  \
  template Eigen::VectorXd boundary_load<Dim>(const DensitySamples<Dim>&,                         \
                                              const fem::Geometry<Dim>&, int);                    \
  template void add_boundary_terms<Dim>(const DensitySamples<Dim>&, const fem::Geometry<Dim>&,    \
                                        int, const Eigen::VectorXd&, double, ShapeTerms<Dim>&);   \
  template void add_boundary_second<Dim>(const DensitySamples<Dim>&, const fem::Geometry<Dim>&,   \
                                         int, const fem::Curvature&, double, SparseMatrix&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::energy
