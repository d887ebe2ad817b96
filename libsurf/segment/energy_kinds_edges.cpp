#include <cmath>

#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/anisotropic_integral.h"
#include "libsurf/energy/boundary_functional.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/energy/fields.h"
#include "libsurf/segment/detail/built_in_kinds.h"

namespace surf::segment {
namespace {

constexpr double kAlignmentSmoothing = 0.1;    // of |s| at 0, in units of the scale
constexpr double kThirdDerivativeStep = 0.01;  // cells

template <int Dim>
double strength_round_seeds(const KindContext<Dim>& context) {
  return estimate_edge_strength<Dim>(*context.model.intensity(), context.seeds_mm,
                                     context.model.extent());
}

template <int Dim>
std::shared_ptr<const Field<Dim>> edge_indicator(const KindContext<Dim>& context,
                                                 const EnergyTerm& term) {
  return context.model.edge_indicator(parameter(term, "lambda"));
}

/// gamma that makes the seed balls grow: four times what keeps one in balance, 4 (Dim - 1)
/// gamma_0 / r, but at most 0.6 gamma_0 / b unless that is too little to grow, b the deviation of
/// the edges' whole blur and at least 1.2 cells: an edge a few cells wide resists about d_nu H / H
/// = 0.6 / cell, a wider one less, and a stronger force leaks through.
template <int Dim>
double balloon(const KindContext<Dim>& context, const EnergyTerm& term) {
  if (context.initial) return 0;
  const double gamma_0 = parameter(term, "gamma0");
  const double balance = (Dim - 1) * gamma_0 / context.seed_radius_mm;
  const double barrier = 0.6 * gamma_0 / std::max(1.2 * context.cell_mm(), context.edge_blur_mm);
  return -std::max(1.2 * balance, std::min(4 * balance, barrier));
}

template <int Dim>
KindParameter<Dim> gamma0_parameter() {
  return {
      .key = "gamma0", .meaning = "weight of the area", .standard = ParameterDefault<Dim>::of(1)};
}

template <int Dim>
KindParameter<Dim> gamma_parameter() {
  return {.key = "gamma",
          .unit = "1/mm",
          .meaning = "weight of the volume, < 0 grows",
          .standard = ParameterDefault<Dim>::chosen(
              balloon<Dim>,
              "0 from an initial shape; else four times what keeps the seeds' balls from "
              "shrinking, but at most 0.6 gamma0 over the edges' blur if they grow by that")};
}

template <int Dim>
EnergyKind<Dim> minimal_surface() {
  EnergyKind<Dim> kind{
      "minimal-surface",
      "gamma0 int_Gamma H dS + gamma int_Omega H dx, H = 1 / (1 + |grad I|^2 / lambda^2), (1.6), "
      "(5.1)",
      "The geodesic active contour: for objects with clear edges all round and without deep "
      "concavities.",
      {gamma0_parameter<Dim>(), gamma_parameter<Dim>(), lambda_parameter<Dim>()}};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    auto sum = std::make_unique<energy::EnergySum<Dim>>();
    energy::add_minimal_surface<Dim>(*sum, edge_indicator<Dim>(context, term),
                                     parameter(term, "gamma0"), parameter(term, "gamma"),
                                     {.quadrature_order = 2, .ray_spacing_mm = context.cell_mm()});
    return sum;
  };
  kind.integrands = edge_integrands<Dim>;
  kind.edge_strength = [](const EnergyTerm& term) { return parameter(term, "lambda"); };
  kind.edge_field = edge_indicator<Dim>;
  kind.settles_on_edges = true;
  return kind;
}

template <int Dim>
energy::DensityPointer<Dim> alignment_density(const KindContext<Dim>& context,
                                              const EnergyTerm& term) {
  const double sign = parameter(term, "sign"), scale = parameter(term, "scale");
  return energy::alignment_density<Dim>(context.model.intensity(),
                                        sign == 0
                                            ? energy::absolute_alignment(scale, kAlignmentSmoothing)
                                            : energy::signed_alignment(sign, scale),
                                        kThirdDerivativeStep * context.cell_mm());
}

template <int Dim>
std::vector<KindParameter<Dim>> alignment_parameters() {
  return {
      chosen_parameter<Dim>(
          "scale", "intensity/mm", "gradient at which phi is -1 or 1", ParameterRange::positive(),
          [](const auto& context) { return 4 * strength_round_seeds<Dim>(context); },
          "the median first peak of |grad I| on rays from the seeds", -1),
      {.key = "sign",
       .meaning = "1 for bright objects, -1 for dark ones, 0 for edges of either sign",
       .range = ParameterRange::one_of({1, 0, -1}),
       .standard = ParameterDefault<Dim>::of(1)}};
}

template <int Dim>
EnergyKind<Dim> alignment() {
  EnergyKind<Dim> kind{
      "alignment",
      "int_Gamma phi(<grad I, nu>) dS, phi(s) = sign s / scale, or -sqrt(s^2 / scale^2 + 0.01) "
      "with sign = 0",
      "The edge alignment of Kimmel and Bruckstein: goes to where the Laplacian changes its sign, "
      "whatever the slope of the background.",
      alignment_parameters<Dim>()};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return std::make_unique<energy::AnisotropicIntegral<Dim>>(
        alignment_density<Dim>(context, term));
  };
  return kind;
}

template <int Dim>
EnergyKind<Dim> prescribed_curvature() {
  EnergyKind<Dim> kind{
      "prescribed-curvature",
      "1/2 int_Gamma H (kappa - curvature)^2 dS, (1.8)",
      "Leventon's model: a curvature where no edge says otherwise, as a smoothness term that edges "
      "switch off.",
      {curvature_parameter<Dim>(), lambda_parameter<Dim>()}};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return std::make_unique<energy::CurvatureIntegral<Dim>>(energy::squared_curvature<Dim>(
        edge_indicator<Dim>(context, term), parameter(term, "curvature")));
  };
  kind.integrands = edge_integrands<Dim>;
  return kind;
}

template <int Dim>
EnergyKind<Dim> average_edge() {
  EnergyKind<Dim> kind{
      "average-edge",
      "int_Gamma H dS / |Gamma|, (1.9)",
      "The mean of the edge indicator along the boundary: follows concavities, where an integral "
      "punishes length.",
      {lambda_parameter<Dim>()}};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return std::make_unique<energy::BoundaryFunctional<Dim>>(
        energy::average<Dim>(energy::isotropic_density<Dim>(edge_indicator<Dim>(context, term))));
  };
  kind.integrands = edge_integrands<Dim>;
  return kind;
}

template <int Dim>
EnergyKind<Dim> average_alignment() {
  EnergyKind<Dim> kind{
      "average-alignment", "int_Gamma phi(<grad I, nu>) dS / |Gamma|, (1.9), phi as in alignment",
      "The mean of the edge alignment along the boundary.", alignment_parameters<Dim>()};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return std::make_unique<energy::BoundaryFunctional<Dim>>(
        energy::average<Dim>(alignment_density<Dim>(context, term)));
  };
  return kind;
}

}  // namespace

template <int Dim>
KindParameter<Dim> lambda_parameter() {
  constexpr double kBlurPower = -1;  // the gradient at a step falls as the blur widens
  return chosen_parameter<Dim>(
      "lambda", "intensity/mm", "strength of an edge", ParameterRange::positive(),
      strength_round_seeds<Dim>,
      "a quarter of the median first peak of |grad I| on rays from the seeds", kBlurPower);
}

template <int Dim>
std::vector<std::shared_ptr<const Field<Dim>>> edge_integrands(const KindContext<Dim>& context,
                                                               const EnergyTerm& term) {
  if (!term.parameters.contains("lambda")) return {};
  return {edge_indicator<Dim>(context, term)};
}

template <int Dim>
std::vector<EnergyKind<Dim>> edge_kinds() {
  return {minimal_surface<Dim>(), alignment<Dim>(), prescribed_curvature<Dim>(),
          average_edge<Dim>(), average_alignment<Dim>()};
}

template KindParameter<2> lambda_parameter<2>();
template KindParameter<3> lambda_parameter<3>();
template std::vector<std::shared_ptr<const Field<2>>> edge_integrands<2>(const KindContext<2>&,
                                                                         const EnergyTerm&);
template std::vector<std::shared_ptr<const Field<3>>> edge_integrands<3>(const KindContext<3>&,
                                                                         const EnergyTerm&);
template std::vector<EnergyKind<2>> edge_kinds<2>();
template std::vector<EnergyKind<3>> edge_kinds<3>();

}  // namespace surf::segment
