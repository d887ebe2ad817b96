#include "libsurf/energy/curvature_integral.h"

#include <algorithm>
#include <vector>

#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/fem/stiffness.h"

namespace surf::energy {
namespace {

template <int Dim>
using Matrix = Eigen::Matrix<double, Dim, Dim>;

template <int Dim>
SparseMatrix unit_stiffness(const fem::Geometry<Dim>& shape) {
  return fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
}

/// The tangential Jacobian D_Gamma u of a nodal vector field on element t.
template <int Dim>
Matrix<Dim> jacobian(const Points<Dim>& u, const fem::Geometry<Dim>& shape, Eigen::Index t) {
  Matrix<Dim> out = Matrix<Dim>::Zero();
  for (int i = 0; i < Dim; ++i)
    out += u.row(shape.elements()(t, i)).transpose() * shape.basis_gradients(t).row(i);
  return out;
}

/// sum_i a_i d m_i + u_i . d F_i + v_i . d N_i by vertex, with the masses m, F = A X, the gradient
/// of the length or area, and N = m n, the gradient of the enclosed content: u and v meet the
/// second derivatives of length or area and content, which are symmetric.
template <int Dim>
Points<Dim> pulled_back(const fem::Geometry<Dim>& shape, const Eigen::VectorXd& a,
                        const Points<Dim>& u, const Points<Dim>& v) {
  const Elements<Dim>& T = shape.elements();
  Points<Dim> out = Points<Dim>::Zero(shape.n_vertices(), Dim);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const Vector<Dim> nu = shape.normals().row(t);
    const Matrix<Dim> Du = jacobian<Dim>(u, shape, t), Dv = jacobian<Dim>(v, shape, t);
    double mean_a = 0;
    for (int i = 0; i < Dim; ++i) mean_a += a[T(t, i)] / Dim;
    // d(|t| nu) = |t| (tr Dv nu - Dv^T nu)
    const Vector<Dim> normal_change = (Dv.trace() * nu - Dv.transpose() * nu) / Dim;
    for (int i = 0; i < Dim; ++i) {
      const Vector<Dim> gradient = shape.basis_gradients(t).row(i);
      // d grad phi = nu (nu . Du grad phi) - Du^T grad phi
      const Vector<Dim> gradient_change =
          nu * nu.dot(Du * gradient) - Du.transpose() * gradient + Du.trace() * gradient;
      out.row(T(t, i)) +=
          shape.measures()[t] * (mean_a * gradient + gradient_change + normal_change);
    }
  }
  return out;
}

/// The unit normals N / |N|, (n, Dim), and kappa_i = F_i . N_i / (m_i |N_i|). Unlike those of
/// fem::mean_curvature, which are shorter by |N_i| / m_i, these curvatures see what is sharp: on a
/// spike |N| is far less than m, and with the short ones the spikes that a box leaves stay.
template <int Dim>
struct SharpCurvature {
  SharpCurvature(const fem::Geometry<Dim>& shape, const SparseMatrix& A)
      : F(A * shape.points()),
        length((shape.lumped_mass().asDiagonal() * shape.nodal_normals())
                   .rowwise()
                   .norm()
                   .cwiseMax(1e-12 * shape.lumped_mass())),
        normals((shape.lumped_mass().cwiseQuotient(length)).asDiagonal() * shape.nodal_normals()),
        kappa(F.cwiseProduct(normals).rowwise().sum().cwiseQuotient(shape.lumped_mass())) {}

  Points<Dim> F;           ///< A X, the gradient of the length or area
  Eigen::VectorXd length;  ///< |N_i|
  Points<Dim> normals;
  Eigen::VectorXd kappa;
};

double mean_over(const Eigen::VectorXd& nodal, const auto& element) {
  double sum = 0;
  for (Eigen::Index i = 0; i < element.size(); ++i) sum += nodal[element[i]];
  return sum / double(element.size());
}

/// Of the vertices those on a border, where the curvature is not known, and those next to them:
/// what the curvature of these is hangs on where the border's vertices lie, and nothing may pull
/// these.
template <int Dim>
std::vector<char> are_near_border(const fem::Geometry<Dim>& shape) {
  std::vector<char> out(std::size_t(shape.n_vertices()), 0);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const auto element = shape.elements().row(t);
    const bool is_near =
        std::any_of(element.begin(), element.end(), [&](int i) { return shape.is_on_border(i); });
    for (const int i : element) out[std::size_t(i)] |= is_near;
  }
  return out;
}

}  // namespace

/// Vertices on a border and next to it are left out.
///
/// The coefficients of the second derivative:
///   int c Lap V Lap W - d (V Lap W + W Lap V) + e V W
///     + (H - kappa H_z) grad V . grad W - 2 H_z grad V . S grad W
///     - (H_z grad kappa + 2 S grad H_z) . (V grad W + W grad V) dS
template <int Dim>
struct CurvatureIntegral<Dim>::Form {
  CurvatureSamples<Dim> H;
  Eigen::VectorXd c, d, e;     // (n)
  Eigen::VectorXd stiffness;   // (n) H - kappa H_z
  std::vector<Matrix<Dim>> S;  // (m)
};

template <int Dim>
CurvatureIntegral<Dim>::CurvatureIntegral(std::shared_ptr<const CurvatureDensity<Dim>> H)
    : H_(std::move(H)) {}

template <int Dim>
CurvatureSamples<Dim> CurvatureIntegral<Dim>::sample(const fem::Geometry<Dim>& shape,
                                                     const Eigen::VectorXd& kappa,
                                                     Derivatives order) const {
  CurvatureSamples<Dim> out;
  H_->sample(shape.points(), kappa, order, out);
  if (!shape.has_border()) return out;
  const std::vector<char> is_left_out = are_near_border<Dim>(shape);
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
    if (!is_left_out[std::size_t(i)]) continue;
    out.value[i] = 0;
    if (order != Derivatives::kNone) out.dz[i] = 0, out.dx.row(i).setZero();
    if (order != Derivatives::kSecond) continue;
    out.dzz[i] = 0;
    out.dxx.row(i).setZero();
    out.dxz.row(i).setZero();
  }
  return out;
}

template <int Dim>
double CurvatureIntegral<Dim>::evaluate(const fem::Geometry<Dim>& shape) const {
  const SharpCurvature<Dim> sharp(shape, unit_stiffness<Dim>(shape));
  return shape.lumped_mass().dot(sample(shape, sharp.kappa, Derivatives::kNone).value);
}

template <int Dim>
typename CurvatureIntegral<Dim>::Form CurvatureIntegral<Dim>::form(
    const fem::Curvature& curvature) const {
  const auto& shape = this->shape();
  const Eigen::Index n = shape.n_vertices();
  const Eigen::VectorXd &kappa = curvature.mean, &q = curvature.square_sum;
  const Points<Dim> normals = shape.nodal_normals().rowwise().normalized();
  Form form;
  form.H = sample(shape, kappa, Derivatives::kSecond);
  form.S = fem::shape_operators<Dim>(shape);
  form.c = form.H.dzz;
  form.stiffness = form.H.value - kappa.cwiseProduct(form.H.dz);
  form.d.resize(n);
  form.e.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector<Dim> nu = normals.row(i);
    const Eigen::Map<const Matrix<Dim>> H_xx(form.H.dxx.row(i).data());
    const double H = form.H.value[i], H_z = form.H.dz[i], H_nu = form.H.dx.row(i).dot(nu);
    const double b = form.H.dxz.row(i).dot(nu) + kappa[i] * H_z;
    const double cubes = kappa[i] * (3 * q[i] - kappa[i] * kappa[i]) / 2;  // sum kappa_i^3
    form.d[i] = b - form.c[i] * q[i];
    form.e[i] = nu.dot(H_xx * nu) + 2 * kappa[i] * H_nu + (kappa[i] * kappa[i] - q[i]) * H +
                2 * H_z * cubes - 2 * b * q[i] + form.c[i] * q[i] * q[i];
  }
  return form;
}

template <int Dim>
void CurvatureIntegral<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                           ShapeTerms<Dim>& terms) const {
  const auto& shape = this->shape();
  const Eigen::VectorXd& m = shape.lumped_mass();
  const SharpCurvature<Dim> sharp(shape, unit_stiffness<Dim>(shape));
  const auto H = sample(shape, sharp.kappa, Derivatives::kFirst);
  // d kappa = nu . dF / m + (F - (F . nu) nu) . dN / (m |N|) - kappa dm / m
  const Eigen::VectorXd a = H.value - H.dz.cwiseProduct(sharp.kappa);
  const Points<Dim> u = H.dz.asDiagonal() * sharp.normals;
  const Points<Dim> tangential =
      sharp.F - Points<Dim>(sharp.kappa.cwiseProduct(m).asDiagonal() * sharp.normals);
  const Points<Dim> v = H.dz.cwiseQuotient(sharp.length).asDiagonal() * tangential;
  terms.derivative += weight * (pulled_back<Dim>(shape, a, u, v) + m.asDiagonal() * H.dx);

  const Form form = this->form(curvature);
  terms.bilaplacian += weight * form.c;
  terms.beta += weight * form.e;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const auto element = shape.elements().row(t);
    terms.alpha[t] +=
        weight * (mean_over(form.stiffness, element) + 2 * mean_over(form.d, element) -
                  2 * mean_over(form.H.dz, element) * form.S[t].trace() / (Dim - 1));
  }
}

template <int Dim>
void CurvatureIntegral<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                                 SecondDerivative<Dim>& second) const {
  const auto& shape = this->shape();
  const Form form = this->form(curvature);
  second.bilaplacian += weight * form.c;
  SparseMatrix A = unit_stiffness<Dim>(shape);
  second.sparse += weight * SparseMatrix(form.d.asDiagonal() * A);
  second.sparse += weight * SparseMatrix(A * form.d.asDiagonal());
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
    second.sparse.coeffRef(i, i) += weight * shape.lumped_mass()[i] * form.e[i];
  add_element_matrices<Dim>(shape, weight, second.sparse, [&](Eigen::Index t) {
    const auto element = shape.elements().row(t);
    const auto& gradients = shape.basis_gradients(t);
    Vector<Dim> grad_kappa = Vector<Dim>::Zero(), grad_H_z = Vector<Dim>::Zero();
    for (int i = 0; i < Dim; ++i) {
      grad_kappa += curvature.mean[element[i]] * gradients.row(i);
      grad_H_z += form.H.dz[element[i]] * gradients.row(i);
    }
    const double H_z = mean_over(form.H.dz, element);
    Matrix<Dim> stiffness = -2 * H_z * form.S[t];
    stiffness.diagonal().array() += mean_over(form.stiffness, element);
    const Vector<Dim> mixed = H_z * grad_kappa + 2 * form.S[t] * grad_H_z;
    const Matrix<Dim> cross = Vector<Dim>::Constant(1.0 / Dim) *
                              (gradients * mixed).transpose();  // int phi_i = |t| / Dim
    return Matrix<Dim>(shape.measures()[t] *
                       (gradients * stiffness * gradients.transpose() - cross - cross.transpose()));
  });
}

template class CurvatureIntegral<2>;
template class CurvatureIntegral<3>;

}  // namespace surf::energy
