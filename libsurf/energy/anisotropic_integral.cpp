#include "libsurf/energy/anisotropic_integral.h"

#include "libsurf/energy/detail/density_terms.h"

namespace surf::energy {

template <int Dim>
AnisotropicIntegral<Dim>::AnisotropicIntegral(DensityPointer<Dim> H, int quadrature_order)
    : H_(std::move(H)), quadrature_order_(quadrature_order) {}

template <int Dim>
double AnisotropicIntegral<Dim>::evaluate(const fem::Geometry<Dim>& shape) const {
  const auto H = sample_boundary<Dim>(*H_, shape, quadrature_order_, Derivatives::kNone);
  return boundary_sum<Dim>(H.value, shape, quadrature_order_);
}

template <int Dim>
void AnisotropicIntegral<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                             ShapeTerms<Dim>& terms) const {
  const auto& shape = this->shape();
  const auto H = sample_boundary<Dim>(*H_, shape, quadrature_order_, Derivatives::kSecond);
  add_boundary_terms<Dim>(H, shape, quadrature_order_, curvature.mean, weight, terms);
}

template <int Dim>
void AnisotropicIntegral<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                                   SecondDerivative<Dim>& second) const {
  const auto& shape = this->shape();
  const auto H = sample_boundary<Dim>(*H_, shape, quadrature_order_, Derivatives::kSecond);
  add_boundary_second<Dim>(H, shape, quadrature_order_, curvature, weight, second.sparse);
}

template class AnisotropicIntegral<2>;
template class AnisotropicIntegral<3>;

}  // namespace surf::energy
