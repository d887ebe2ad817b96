#include "libsurf/energy/content.h"

#include "libsurf/fem/mass.h"

namespace surf::energy {

template <int Dim>
void Content<Dim>::differentiate(const fem::Curvature& curvature, double weight,
                                 ShapeTerms<Dim>& terms) const {
  const auto& shape = this->shape();
  terms.derivative += weight * (shape.lumped_mass().asDiagonal() * shape.nodal_normals());
  terms.beta += weight * curvature.mean;
}

template <int Dim>
void Content<Dim>::differentiate_twice(const fem::Curvature& curvature, double weight,
                                       SecondDerivative<Dim>& second) const {
  second.sparse += weight * fem::mass_nodal_weight<Dim>(this->shape(), curvature.mean);
}

template <int Dim>
void Content<Dim>::add_density(const Points<Dim>&, double weight, Eigen::VectorXd& density) const {
  density.array() += weight;
}

template class Content<2>;
template class Content<3>;

}  // namespace surf::energy
