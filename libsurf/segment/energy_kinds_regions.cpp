#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/region_statistics.h"
#include "libsurf/segment/detail/built_in_kinds.h"
#include "libsurf/segment/local_means.h"

namespace surf::segment {
namespace {

constexpr double kConstant = 1e-12;  // of the mean square

// Of mumford-shah: sqrt(mu) and gamma. In space the box that is solved in keeps 6 sqrt(mu) from the
// surface.
template <int Dim>
constexpr double kSmoothingCells = Dim == 2 ? 32 : 10;
template <int Dim>
constexpr double kLengthCells = Dim == 2 ? 0.5 : 0.25;

template <int Dim>
EnergyKind<Dim> chan_vese() {
  EnergyKind<Dim> kind;
  kind.name = "chan-vese";
  kind.formula =
      "int_Omega (I - mu_1)^2 dx + int_(D - Omega) (I - mu_2)^2 dx, over the squared contrast, "
      "1.1.2, (1.10)";
  kind.description =
      "Means of both sides: for objects without edges, smooth transitions, noise; needs area.";
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm&) {
    const energy::ImageTotals all = context.model.totals();
    const double mean = all.intensity / all.content;
    const double variance = all.intensity_squared / all.content - mean * mean;
    energy::ChanVeseOptions options;
    options.ray_spacing_mm = context.cell_mm();
    // Of a constant image the variance is rounding: nothing may be measured by it.
    const bool is_constant = !(variance > kConstant * all.intensity_squared / all.content);
    options.intensity_scale = is_constant ? 1 : std::sqrt(variance);
    return std::make_unique<energy::ChanVese<Dim>>(context.model.intensity(), all, options,
                                                   context.model.antiderivative());
  };
  kind.settles_on_edges = true;
  return kind;
}

template <int Dim>
EnergyKind<Dim> region_competition() {
  EnergyKind<Dim> kind;
  kind.name = "region-competition";
  kind.formula = "sum_i |Omega_i| / 2 log sigma_i^2, (1.10)";
  kind.description =
      "Means and variances of both sides: tells textures of equal mean apart; needs area.";
  kind.build = [name = kind.name](const KindContext<Dim>& context, const EnergyTerm&) {
    return std::make_unique<energy::RegionStatistics<Dim>>(
        name, context.model.intensity(),
        energy::region_competition(context.model.smoothed_totals()),
        energy::StatisticsOptions{.ray_spacing_mm = context.cell_mm()});
  };
  return kind;
}

template <int Dim>
EnergyKind<Dim> local_means_kind() {
  using Default = ParameterDefault<Dim>;
  using Context = KindContext<Dim>;
  EnergyKind<Dim> kind;
  kind.name = "local-means";
  kind.formula =
      "int_Omega f dx from the initial shape on, f = -tanh(q - 8 max(v, 0)^3) + 2 z u + 3/2 z^9, "
      "q = (2 I - m_1 - m_2) c / m, v = (I - m_1) c / m, c = m_1 - m_2, m = c^2 + (2 noise)^2, "
      "z = d / reach, u = (4 noise)^4 / (c^4 + (4 noise)^4)";
  kind.description =
      "Local means m_1, m_2 of both sides of an initial shape, and the distance d to it: for what "
      "lies within a few cells of a start.";
  kind.parameters = {
      {.key = "reach",
       .unit = "mm",
       .meaning = "how far the shape may be from the initial one",
       .range = ParameterRange::positive(),
       .standard = Default::chosen(
           [](const Context& context, const EnergyTerm&) { return 3 * context.cell_mm(); },
           "3 cells")},
      {.key = "edge",
       .unit = "mm",
       .meaning = "deviation of the edges' blur: twice as far is on neither side",
       .range = ParameterRange::not_negative(),
       .standard = Default::chosen(
           [](const Context& context, const EnergyTerm&) { return context.cell_mm(); }, "1 cell"),
       .blur_power = 1},
      {.key = "noise",
       .unit = "intensity",
       .meaning = "means that differ by less are not told apart",
       .range = ParameterRange::positive(),
       .standard = Default::chosen(
           [](const Context& context, const EnergyTerm&) {
             const auto [lowest, highest] = context.model.extent().range;
             return std::max(context.seed.noise, 1e-6 * (double(highest) - lowest) + 1e-300);
           },
           "that round the seeds")}};
  kind.build = [](const Context& context, const EnergyTerm& term) {
    if (!context.initial || !context.shape || !context.setting)
      throw UsageError("energy local-means: it is fitted to an initial shape, and there is none");
    const LocalMeansOptions options{parameter(term, "reach"), parameter(term, "edge"),
                                    parameter(term, "noise")};
    return std::make_unique<energy::DomainIntegral<Dim>>(
        local_means<Dim>(*context.setting, context.model.intensity(), *context.initial,
                         *context.shape, options),
        energy::DomainIntegralOptions{.quadrature_order = 2, .counts_from_start = true});
  };
  kind.settles_on_edges = true;
  kind.is_fitted = true;
  return kind;
}

template <int Dim>
std::shared_ptr<const Field<Dim>> window_field(const KindContext<Dim>& context,
                                               const EnergyTerm& term) {
  return energy::mapped_field<Dim>(
      context.model.intensity(),
      energy::intensity_window(parameter(term, "mean"), parameter(term, "half-width")));
}

template <int Dim>
EnergyKind<Dim> window() {
  using Default = ParameterDefault<Dim>;
  using Context = KindContext<Dim>;
  EnergyKind<Dim> kind;
  kind.name = "window";
  kind.formula = "int_Omega f(I) dx, f = (z^4 - 1) / (z^4 + 1), z = (I - mean) / half-width";
  kind.description = "Takes what lies in a window of intensities; needs area.";
  kind.parameters = {
      {.key = "mean",
       .unit = "intensity",
       .meaning = "middle of the window",
       .standard = Default::chosen(
           [](const Context& context, const EnergyTerm&) { return context.seed.mean; },
           "the median intensity round the seeds")},
      {.key = "half-width",
       .unit = "intensity",
       .meaning = "where f is 0",
       .range = ParameterRange::positive(),
       .standard = Default::chosen(
           [](const Context& context, const EnergyTerm&) { return 4 * context.seed.deviation; },
           "4 deviations of the intensities round the seeds")}};
  kind.build = [](const Context& context, const EnergyTerm& term) {
    return std::make_unique<energy::DomainIntegral<Dim>>(
        window_field<Dim>(context, term),
        energy::DomainIntegralOptions{.quadrature_order = 2, .ray_spacing_mm = context.cell_mm()});
  };
  kind.integrands = [](const Context& context, const EnergyTerm& term) {
    return std::vector{window_field<Dim>(context, term)};
  };
  kind.settles_on_edges = true;
  kind.takes_long_steps = false;
  return kind;
}

template <int Dim>
PiecewiseSmooth piecewise_smooth(const EnergyTerm& term) {
  PiecewiseSmooth out{
      parameter(term, "mu"), parameter(term, "gamma"), parameter(term, "contrast"), {}};
  if (const auto at = term.parameters.find("data-tolerance"); at != term.parameters.end())
    out.data_tolerance = at->second;
  return out;
}

template <int Dim>
std::vector<KindParameter<Dim>> mumford_shah_parameters() {
  using Default = ParameterDefault<Dim>;
  using Context = KindContext<Dim>;
  return {{.key = "mu",
           .unit = "mm^2",
           .meaning = "u follows I over lengths above sqrt(mu)",
           .range = ParameterRange::positive(),
           .standard = Default::chosen(
               [](const Context& context, const EnergyTerm&) {
                 return std::pow(kSmoothingCells<Dim> * context.cell_mm(), 2);
               },
               Dim == 2 ? "(32 px)^2" : "(10 vox)^2")},
          {.key = "gamma",
           .unit = "mm",
           .meaning = "weight of the area",
           .range = ParameterRange::not_negative(),
           .standard = Default::chosen(
               [](const Context& context, const EnergyTerm&) {
                 return kLengthCells<Dim> * context.cell_mm();
               },
               Dim == 2 ? "0.5 px" : "0.25 vox")},
          {.key = "contrast",
           .unit = "intensity",
           .meaning = "what intensities are divided by",
           .range = ParameterRange::positive(),
           .standard = Default::chosen(
               [](const Context& context, const EnergyTerm&) { return context.model.contrast(); },
               "the distance of the image's two classes of intensities")}};
}

/// In the plane with its domain meshes: Alg. 8 on them, and the first part of Alg. 17, in which
/// they are not adapted to data.
template <int Dim>
EnergyKind<Dim> mumford_shah() {
  EnergyKind<Dim> kind;
  kind.name = "mumford-shah";
  kind.formula =
      "sum_i 1/2 int_(Omega_i) (u_i - I)^2 + mu |grad u_i|^2 dx + gamma |Gamma|, I by contrast, "
      "(5.4)";
  kind.description =
      "A smooth approximation of both sides along with the shape: segments and "
      "denoises at once.";
  kind.parameters = mumford_shah_parameters<Dim>();
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return context.model.mumford_shah(piecewise_smooth<Dim>(term));
  };
  kind.piecewise_smooth = piecewise_smooth<Dim>;
  if constexpr (Dim == 2) {
    kind.parameters.push_back({.key = "data-tolerance",
                               .meaning = "of Alg. 8 on the domains' meshes; 0: not used",
                               .range = ParameterRange::not_negative(),
                               .standard = ParameterDefault<Dim>::absent("0.05")});
    kind.coarse = [](EnergyTerm term) {
      term.parameters["data-tolerance"] = 0;
      return term;
    };
  }
  return kind;
}

}  // namespace

template <int Dim>
std::vector<EnergyKind<Dim>> region_kinds() {
  return {chan_vese<Dim>(), region_competition<Dim>(), local_means_kind<Dim>(), window<Dim>(),
          mumford_shah<Dim>()};
}

template std::vector<EnergyKind<2>> region_kinds<2>();
template std::vector<EnergyKind<3>> region_kinds<3>();

}  // namespace surf::segment
