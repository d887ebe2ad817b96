#include "libsurf/energy/boundary_functional.h"

#include "libsurf/energy/detail/density_terms.h"

namespace surf::energy {
namespace {

template <int Dim>
class Average : public DensityFamily<Dim> {
 public:
  explicit Average(DensityPointer<Dim> H)
      : H_(std::move(H)), integrands_{isotropic_density<Dim>(constant_field<Dim>(1))} {}
  const std::vector<DensityPointer<Dim>>& integrands() const override { return integrands_; }
  DensityPointer<Dim> at(const Eigen::VectorXd& p) const override {
    return scaled_density<Dim>(H_, 1 / p[0]);
  }
  DensityPointer<Dim> first(const Eigen::VectorXd& p, int) const override {
    return scaled_density<Dim>(H_, -1 / (p[0] * p[0]));
  }
  DensityPointer<Dim> second(const Eigen::VectorXd& p, int, int) const override {
    return scaled_density<Dim>(H_, 2 / (p[0] * p[0] * p[0]));
  }

 private:
  DensityPointer<Dim> H_;
  std::vector<DensityPointer<Dim>> integrands_;
};

}  // namespace

/// The current integrals p and samples of the frozen density, to second derivatives.
template <int Dim>
struct BoundaryFunctional<Dim>::Frozen {
  Eigen::VectorXd p;
  DensitySamples<Dim> density;
};

template <int Dim>
BoundaryFunctional<Dim>::BoundaryFunctional(std::shared_ptr<const DensityFamily<Dim>> H,
                                            int quadrature_order)
    : H_(std::move(H)), quadrature_order_(quadrature_order) {}

template <int Dim>
double BoundaryFunctional<Dim>::integral(const DensityPointer<Dim>& density,
                                         const fem::Geometry<Dim>& shape) const {
  if (!density) return 0;
  const auto samples = sample_boundary<Dim>(*density, shape, quadrature_order_, Derivatives::kNone);
  return boundary_sum<Dim>(samples.value, shape, quadrature_order_);
}

template <int Dim>
Eigen::VectorXd BoundaryFunctional<Dim>::integrals(const fem::Geometry<Dim>& shape) const {
  const auto& w = H_->integrands();
  Eigen::VectorXd p(w.size());
  for (std::size_t k = 0; k < w.size(); ++k) p[k] = integral(w[k], shape);
  return p;
}

template <int Dim>
double BoundaryFunctional<Dim>::evaluate(const fem::Geometry<Dim>& shape) const {
  return integral(H_->at(integrals(shape)), shape);
}

template <int Dim>
typename BoundaryFunctional<Dim>::Frozen BoundaryFunctional<Dim>::frozen() const {
  const auto& shape = this->shape();
  const auto& w = H_->integrands();
  Frozen out;
  out.p = integrals(shape);
  const auto H = H_->at(out.p);
  if (H) out.density = sample_boundary<Dim>(*H, shape, quadrature_order_, Derivatives::kSecond);
  for (std::size_t k = 0; k < w.size(); ++k) {
    const auto samples =
        sample_boundary<Dim>(*w[k], shape, quadrature_order_, Derivatives::kSecond);
    if (!H && k == 0) out.density.resize(samples.value.size(), Derivatives::kSecond);
    out.density.add(integral(H_->first(out.p, int(k)), shape), samples);
  }
  return out;
}

template <int Dim>
void BoundaryFunctional<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                            ShapeTerms<Dim>& terms) const {
  add_boundary_terms<Dim>(frozen().density, this->shape(), quadrature_order_, curvature.mean,
                          weight, terms);
}

template <int Dim>
void BoundaryFunctional<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                                  SecondDerivative<Dim>& second) const {
  const auto& shape = this->shape();
  const auto [p, density] = frozen();
  add_boundary_second<Dim>(density, shape, quadrature_order_, curvature, weight, second.sparse);
  const int n = static_cast<int>(p.size());
  const auto load = [&](const DensityPointer<Dim>& H) -> Eigen::VectorXd {
    if (!H) return Eigen::VectorXd::Zero(shape.n_vertices());
    return boundary_load<Dim>(
        sample_boundary<Dim>(*H, shape, quadrature_order_, Derivatives::kFirst), shape,
        quadrature_order_);
  };
  Eigen::MatrixXd vectors(shape.n_vertices(), 2 * n);  // w_1 .. w_n, dH/dp_1 .. dH/dp_n
  Eigen::MatrixXd coefficients = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (int k = 0; k < n; ++k) {
    vectors.col(k) = load(H_->integrands()[k]);
    vectors.col(n + k) = load(H_->first(p, k));
    coefficients(k, n + k) = coefficients(n + k, k) = weight;
    for (int l = 0; l < n; ++l) coefficients(k, l) = weight * integral(H_->second(p, k, l), shape);
  }
  second.add_integrals(vectors, coefficients);
}

template <int Dim>
std::shared_ptr<const DensityFamily<Dim>> average(DensityPointer<Dim> H) {
  return std::make_shared<const Average<Dim>>(std::move(H));
}

template class BoundaryFunctional<2>;
template class BoundaryFunctional<3>;
template std::shared_ptr<const DensityFamily<2>> average<2>(DensityPointer<2>);
template std::shared_ptr<const DensityFamily<3>> average<3>(DensityPointer<3>);

}  // namespace surf::energy
