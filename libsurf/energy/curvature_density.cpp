#include "libsurf/energy/curvature_density.h"

#include "libsurf/energy/detail/derivative_rows.h"

namespace surf::energy {
namespace {

template <int Dim>
class SquaredCurvature : public CurvatureDensity<Dim> {
 public:
  SquaredCurvature(std::shared_ptr<const Field<Dim>> f, double z_0) : f_(std::move(f)), z_0_(z_0) {}

  void sample(const Points<Dim>& x, const Eigen::VectorXd& z, Derivatives order,
              CurvatureSamples<Dim>& out) const override {
    Samples<Dim> f;
    f_->sample(x, order, f);
    out.resize(x.rows(), order);
    const Eigen::VectorXd excess = z.array() - z_0_;
    const Eigen::VectorXd half_square = excess.cwiseAbs2() / 2;
    out.value = f.value.cwiseProduct(half_square);
    if (order == Derivatives::kNone) return;
    out.dz = f.value.cwiseProduct(excess);
    out.dx = half_square.asDiagonal() * f.gradient;
    if (order == Derivatives::kFirst) return;
    out.dzz = f.value;
    out.dxz = excess.asDiagonal() * f.gradient;
    out.dxx = half_square.asDiagonal() * f.hessian;
  }

 private:
  std::shared_ptr<const Field<Dim>> f_;
  double z_0_;
};

}  // namespace

template <int Dim>
void CurvatureSamples<Dim>::resize(Eigen::Index n, Derivatives order) {
  const DerivativeRows n_rows(n, order);
  value.setZero(n);
  dz.setZero(n_rows.first);
  dx.setZero(n_rows.first, Dim);
  dzz.setZero(n_rows.second);
  dxz.setZero(n_rows.second, Dim);
  dxx.setZero(n_rows.second, Dim * Dim);
}

template <int Dim>
std::shared_ptr<const CurvatureDensity<Dim>> squared_curvature(std::shared_ptr<const Field<Dim>> f,
                                                               double z_0) {
  return std::make_shared<const SquaredCurvature<Dim>>(std::move(f), z_0);
}

template struct CurvatureSamples<2>;
template struct CurvatureSamples<3>;
template std::shared_ptr<const CurvatureDensity<2>> squared_curvature<2>(
    std::shared_ptr<const Field<2>>, double);
template std::shared_ptr<const CurvatureDensity<3>> squared_curvature<3>(
    std::shared_ptr<const Field<3>>, double);

}  // namespace surf::energy
