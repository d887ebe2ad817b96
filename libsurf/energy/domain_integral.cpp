#include "libsurf/energy/domain_integral.h"

namespace surf::energy {
namespace {

void identity(const Eigen::VectorXd& value, Eigen::MatrixXd& out) { out.col(0) = value; }

}  // namespace

template <int Dim>
DomainIntegral<Dim>::DomainIntegral(std::shared_ptr<const Field<Dim>> F,
                                    const DomainIntegralOptions& options)
    : RegionEnergy<Dim>(std::move(F), identity, 1, options) {}

template <int Dim>
std::function<std::array<double, 2>(double)> DomainIntegral<Dim>::density() const {
  return [](double value) { return std::array<double, 2>{value, 1}; };
}

template class DomainIntegral<2>;
template class DomainIntegral<3>;

}  // namespace surf::energy
