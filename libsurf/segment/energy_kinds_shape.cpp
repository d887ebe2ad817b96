#include <array>
#include <cmath>

#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/anisotropic_integral.h"
#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/content.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/segment/detail/built_in_kinds.h"

namespace surf::segment {
namespace {

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

template <int Dim>
EnergyKind<Dim> area() {
  EnergyKind<Dim> kind{"area", "|Gamma|, (1.6) with H = 1",
                       "Smoothness beside region terms; its weight is in mm there."};
  kind.build = [](const KindContext<Dim>&, const EnergyTerm&) {
    return std::make_unique<energy::BoundaryIntegral<Dim>>(energy::constant_field<Dim>(1));
  };
  kind.settles_on_edges = true;
  return kind;
}

template <int Dim>
EnergyKind<Dim> volume() {
  EnergyKind<Dim> kind{"volume", "|Omega|",
                       "With a negative weight, in 1/mm beside area, a balloon."};
  kind.build = [](const KindContext<Dim>&, const EnergyTerm&) {
    return std::make_unique<energy::Content<Dim>>();
  };
  kind.settles_on_edges = true;
  return kind;
}

template <int Dim>
std::unique_ptr<energy::ShapeEnergy<Dim>> anisotropic_energy(const KindContext<Dim>& context,
                                                             const EnergyTerm& term) {
  Vector<Dim> squares;
  for (int axis = 0; axis < Dim; ++axis) squares[axis] = std::pow(parameter(term, kAxes[axis]), 2);
  const auto H = term.parameters.contains("lambda")
                     ? context.model.edge_indicator(parameter(term, "lambda"))
                     : energy::constant_field<Dim>(1);
  return std::make_unique<energy::AnisotropicIntegral<Dim>>(
      energy::norm_density<Dim>(H, squares.asDiagonal()));
}

template <int Dim>
EnergyKind<Dim> anisotropic() {
  using Default = ParameterDefault<Dim>;
  EnergyKind<Dim> kind{
      "anisotropic",
      Dim == 2 ? "int_Gamma H sqrt((x nu_x)^2 + (y nu_y)^2) dS, (1.7)"
               : "int_Gamma H sqrt((x nu_x)^2 + (y nu_y)^2 + (z nu_z)^2) dS, (1.7)",
      "Costs more where the normal is along an axis with a large factor: for objects whose faces "
      "are known to lie one way."};
  for (int axis = 0; axis < Dim; ++axis)
    kind.parameters.push_back({.key = kAxes[axis],
                               .meaning = "factor of the axis",
                               .range = ParameterRange::positive(),
                               .standard = Default::of(1)});
  KindParameter<Dim> lambda = lambda_parameter<Dim>();
  lambda.standard = Default::absent("none: H = 1");
  kind.parameters.push_back(lambda);
  kind.build = anisotropic_energy<Dim>;
  kind.integrands = edge_integrands<Dim>;
  return kind;
}

template <int Dim>
EnergyKind<Dim> willmore() {
  EnergyKind<Dim> kind{
      "willmore",
      "1/2 int_Gamma (kappa - curvature)^2 dS, (1.8) with H = 1",
      "Punishes bending, not size: keeps thin tubes; its weight is in mm^2 beside area.",
      {curvature_parameter<Dim>()}};
  kind.build = [](const KindContext<Dim>&, const EnergyTerm& term) {
    return std::make_unique<energy::CurvatureIntegral<Dim>>(energy::squared_curvature<Dim>(
        energy::constant_field<Dim>(1), parameter(term, "curvature")));
  };
  return kind;
}

}  // namespace

template <int Dim>
KindParameter<Dim> curvature_parameter() {
  return {.key = "curvature",
          .unit = "1/mm",
          .meaning = "sum of the principal curvatures, positive on a ball",
          .standard = ParameterDefault<Dim>::of(0)};
}

template <int Dim>
std::vector<EnergyKind<Dim>> shape_kinds() {
  return {area<Dim>(), volume<Dim>(), anisotropic<Dim>(), willmore<Dim>()};
}

template KindParameter<2> curvature_parameter<2>();
template KindParameter<3> curvature_parameter<3>();
template std::vector<EnergyKind<2>> shape_kinds<2>();
template std::vector<EnergyKind<3>> shape_kinds<3>();

}  // namespace surf::segment
