#include "libsurf/energy/anisotropic_density.h"

#include <cmath>

#include "libsurf/energy/detail/derivative_rows.h"

namespace surf::energy {
namespace {

template <int Dim>
using Matrix = Eigen::Matrix<double, Dim, Dim, Eigen::RowMajor>;
template <int Dim>
using MatrixMap = Eigen::Map<Matrix<Dim>>;
template <int Dim>
using ConstMatrixMap = Eigen::Map<const Matrix<Dim>>;

template <int Dim>
class IsotropicDensity : public AnisotropicDensity<Dim> {
 public:
  explicit IsotropicDensity(std::shared_ptr<const Field<Dim>> H) : H_(std::move(H)) {}
  void sample(const Points<Dim>& x, const Points<Dim>&, Derivatives order,
              DensitySamples<Dim>& out) const override {
    Samples<Dim> samples;
    H_->sample(x, order, samples);
    out.resize(x.rows(), order);
    out.value = samples.value;
    out.dx = samples.gradient;
    out.dxx = samples.hessian;
  }

 private:
  std::shared_ptr<const Field<Dim>> H_;
};

template <int Dim>
class ScaledDensity : public AnisotropicDensity<Dim> {
 public:
  ScaledDensity(DensityPointer<Dim> H, double factor) : H_(std::move(H)), factor_(factor) {}
  void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
              DensitySamples<Dim>& out) const override {
    DensitySamples<Dim> samples;
    H_->sample(x, y, order, samples);
    out.resize(x.rows(), order);
    out.add(factor_, samples);
  }

 private:
  DensityPointer<Dim> H_;
  double factor_;
};

template <int Dim>
class NormDensity : public AnisotropicDensity<Dim> {
 public:
  NormDensity(std::shared_ptr<const Field<Dim>> H, const Eigen::Matrix<double, Dim, Dim>& M)
      : H_(std::move(H)), M_(M) {}
  void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
              DensitySamples<Dim>& out) const override {
    Samples<Dim> samples;
    H_->sample(x, order, samples);
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<Dim> My = M_ * y.row(i).transpose();
      const double norm = std::sqrt(y.row(i).dot(My)), H = samples.value[i];
      const Vector<Dim> slope = My / norm;
      out.value[i] = H * norm;
      if (order == Derivatives::kNone) continue;
      out.dx.row(i) = norm * samples.gradient.row(i);
      out.dy.row(i) = H * slope;
      if (order == Derivatives::kFirst) continue;
      out.dxx.row(i) = norm * samples.hessian.row(i);
      MatrixMap<Dim>(out.dxy.row(i).data()) =
          samples.gradient.row(i).transpose() * slope.transpose();
      MatrixMap<Dim>(out.dyy.row(i).data()) = H / norm * (M_ - slope * slope.transpose());
    }
  }

 private:
  std::shared_ptr<const Field<Dim>> H_;
  Eigen::Matrix<double, Dim, Dim> M_;
};

template <int Dim>
class AlignmentDensity : public AnisotropicDensity<Dim> {
 public:
  AlignmentDensity(std::shared_ptr<const Field<Dim>> I, Profile phi, double step_mm)
      : I_(std::move(I)), phi_(std::move(phi)), step_mm_(step_mm) {}

  void sample(const Points<Dim>& x, const Points<Dim>& y, Derivatives order,
              DensitySamples<Dim>& out) const override {
    Samples<Dim> at, ahead, behind;
    const bool is_twice = order == Derivatives::kSecond;
    I_->sample(x, order == Derivatives::kNone ? Derivatives::kFirst : Derivatives::kSecond, at);
    if (is_twice) {
      I_->sample(x + step_mm_ * y, Derivatives::kSecond, ahead);
      I_->sample(x - step_mm_ * y, Derivatives::kSecond, behind);
    }
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<Dim> grad_I = at.gradient.row(i);
      const auto [value, first, second] = phi_(grad_I.dot(y.row(i)));
      out.value[i] = value;
      if (order == Derivatives::kNone) continue;
      const ConstMatrixMap<Dim> hessian(at.hessian.row(i).data());
      const Vector<Dim> s_x = hessian * y.row(i).transpose();
      out.dx.row(i) = first * s_x;
      out.dy.row(i) = first * grad_I;
      if (!is_twice) continue;
      const Matrix<Dim> third = (ConstMatrixMap<Dim>(ahead.hessian.row(i).data()) -
                                 ConstMatrixMap<Dim>(behind.hessian.row(i).data())) /
                                (2 * step_mm_);
      MatrixMap<Dim>(out.dxx.row(i).data()) = second * s_x * s_x.transpose() + first * third;
      MatrixMap<Dim>(out.dxy.row(i).data()) = second * s_x * grad_I.transpose() + first * hessian;
      MatrixMap<Dim>(out.dyy.row(i).data()) = second * grad_I * grad_I.transpose();
    }
  }

 private:
  std::shared_ptr<const Field<Dim>> I_;
  Profile phi_;
  double step_mm_;
};

}  // namespace

template <int Dim>
void DensitySamples<Dim>::resize(Eigen::Index n, Derivatives order) {
  const DerivativeRows n_rows(n, order);
  value.setZero(n);
  dx.setZero(n_rows.first, Dim);
  dy.setZero(n_rows.first, Dim);
  dxx.setZero(n_rows.second, Dim * Dim);
  dxy.setZero(n_rows.second, Dim * Dim);
  dyy.setZero(n_rows.second, Dim * Dim);
}

template <int Dim>
void DensitySamples<Dim>::add(double factor, const DensitySamples& other) {
  value += factor * other.value;
  dx += factor * other.dx;
  dy += factor * other.dy;
  dxx += factor * other.dxx;
  dxy += factor * other.dxy;
  dyy += factor * other.dyy;
}

template <int Dim>
DensityPointer<Dim> isotropic_density(std::shared_ptr<const Field<Dim>> H) {
  return std::make_shared<const IsotropicDensity<Dim>>(std::move(H));
}

template <int Dim>
DensityPointer<Dim> scaled_density(DensityPointer<Dim> H, double factor) {
  return std::make_shared<const ScaledDensity<Dim>>(std::move(H), factor);
}

template <int Dim>
DensityPointer<Dim> norm_density(std::shared_ptr<const Field<Dim>> H,
                                 const Eigen::Matrix<double, Dim, Dim>& M) {
  return std::make_shared<const NormDensity<Dim>>(std::move(H), M);
}

template <int Dim>
DensityPointer<Dim> alignment_density(std::shared_ptr<const Field<Dim>> I, Profile phi,
                                      double step_mm) {
  return std::make_shared<const AlignmentDensity<Dim>>(std::move(I), std::move(phi), step_mm);
}

Profile signed_alignment(double sign, double scale) {
  return [=](double s) { return std::array<double, 3>{sign * s / scale, sign / scale, 0}; };
}

Profile absolute_alignment(double scale, double smoothing) {
  return [=](double s) {
    const double z = s / scale, root = std::sqrt(z * z + smoothing * smoothing);
    return std::array<double, 3>{-root, -z / root / scale,
                                 -smoothing * smoothing / (root * root * root) / (scale * scale)};
  };
}

#define SURF_INSTANTIATE(Dim)                                                                     \
  template struct DensitySamples<Dim>;                                                            \
  template DensityPointer<Dim> isotropic_density<Dim>(std::shared_ptr<const Field<Dim>>);         \
  template DensityPointer<Dim> scaled_density<Dim>(DensityPointer<Dim>, double);                  \
  template DensityPointer<Dim> norm_density<Dim>(std::shared_ptr<const Field<Dim>>,               \
                                                 const Eigen::Matrix<double, Dim, Dim>&);         \
  template DensityPointer<Dim> alignment_density<Dim>(std::shared_ptr<const Field<Dim>>, Profile, \
                                                      double);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::energy
