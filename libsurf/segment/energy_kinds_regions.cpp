#include <fmt/format.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/energy/region_statistics.h"
#include "libsurf/segment/detail/built_in_kinds.h"
#include "libsurf/segment/detail/local_means.h"

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
  EnergyKind<Dim> kind{
      "chan-vese",
      ("int_Omega (I - mu_1)^2 dx + int_(D - Omega) (I - mu_2)^2 dx, over the squared contrast, "
       "1.1.2, (1.10)"),
      "Means of both sides: for objects without edges, smooth transitions, noise; needs area."};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm&) {
    const energy::ImageTotals all = context.model.totals();
    const double mean = all.intensity / all.content;
    const double variance = all.intensity_squared / all.content - mean * mean;
    energy::ChanVeseOptions options;
    options.ray_spacing_mm = context.cell_mm();
    // Of a constant image the variance is rounding: nothing may be measured by it.
    const bool is_constant = !(variance > kConstant * all.intensity_squared / all.content);
    // Of usual values the deviation is at most half of their range: a broken one has no say.
    const double most = context.model.extent().width() / 2;
    options.intensity_scale = is_constant || !(most > 0) ? 1 : std::min(std::sqrt(variance), most);
    return std::make_unique<energy::ChanVese<Dim>>(context.model.intensity(), all, options,
                                                   context.model.antiderivative());
  };
  kind.settles_on_edges = true;
  return kind;
}

template <int Dim>
EnergyKind<Dim> region_competition() {
  EnergyKind<Dim> kind{
      "region-competition", "sum_i |Omega_i| / 2 log sigma_i^2, (1.10)",
      "Means and variances of both sides: tells textures of equal mean apart; needs area."};
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
  using Context = KindContext<Dim>;
  EnergyKind<Dim> kind{
      "local-means",
      ("int_Omega f dx from the initial shape on, f = -tanh(q - 8 max(v, 0)^3) + 8 z u + 3/2 z^9, "
       "q = (2 I - m_1 - m_2) c / m, v = (I - m_1) c / m, c = m_1 - m_2, m = c^2 + (2 noise)^2, "
       "z = d / reach, u = (4 noise)^4 / (c^4 + (4 noise)^4)"),
      ("Local means m_1, m_2 of both sides of an initial shape, and the distance d to it: for what "
       "lies within a few cells of a start.")};
  kind.parameters = {
      chosen_parameter<Dim>(
          "reach", "mm", "how far the shape may be from the initial one",
          ParameterRange::positive(), [](const Context& context) { return 3 * context.cell_mm(); },
          "3 cells"),
      chosen_parameter<Dim>(
          "edge", "mm", "deviation of the edges' blur: twice as far is on neither side",
          ParameterRange::not_negative(), [](const Context& context) { return context.cell_mm(); },
          "1 cell", 1),
      chosen_parameter<Dim>(
          "noise", "intensity", "means that differ by less are not told apart",
          ParameterRange::positive(),
          [](const Context& context) {
            return std::max(context.seed.noise, 1e-6 * context.model.extent().width() + 1e-300);
          },
          "that round the seeds")};
  kind.build = [](const Context& context, const EnergyTerm& term) {
    if (!context.initial || !context.setting)
      throw UsageError("energy local-means: it is fitted to an initial shape, and there is none");
    const double widest = context.model.extent().diagonal_mm();
    for (const char* length : {"reach", "edge"})
      if (parameter(term, length) > widest)
        throw UsageError(
            fmt::format("energy local-means: {} = {:.4g} mm is wider than the whole image "
                        "({:.4g} mm)",
                        length, parameter(term, length), widest));
    const LocalMeansOptions options{parameter(term, "reach"), parameter(term, "edge"),
                                    parameter(term, "noise")};
    return std::make_unique<energy::DomainIntegral<Dim>>(
        local_means<Dim>(*context.setting, context.model.intensity(), *context.initial, options,
                         context.region),
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
  using Context = KindContext<Dim>;
  EnergyKind<Dim> kind{"window",
                       "int_Omega f(I) dx, f = (z^4 - 1) / (z^4 + 1), z = (I - mean) / half-width",
                       "Takes what lies in a window of intensities; needs area."};
  kind.parameters = {chosen_parameter<Dim>(
                         "mean", "intensity", "middle of the window", ParameterRange::any(),
                         [](const Context& context) { return context.seed.mean; },
                         "the median intensity round the seeds"),
                     chosen_parameter<Dim>(
                         "half-width", "intensity", "where f is 0", ParameterRange::positive(),
                         [](const Context& context) { return 4 * context.seed.deviation; },
                         "4 deviations of the intensities round the seeds")};
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
  using Context = KindContext<Dim>;
  return {
      chosen_parameter<Dim>(
          "mu", "mm^2", "u follows I over lengths above sqrt(mu)", ParameterRange::positive(),
          [](const Context& context) {
            return std::pow(kSmoothingCells<Dim> * context.cell_mm(), 2);
          },
          Dim == 2 ? "(32 px)^2" : "(10 vox)^2"),
      chosen_parameter<Dim>(
          "gamma", "mm", "weight of the area", ParameterRange::not_negative(),
          [](const Context& context) { return kLengthCells<Dim> * context.cell_mm(); },
          Dim == 2 ? "0.5 px" : "0.25 vox"),
      chosen_parameter<Dim>(
          "contrast", "intensity", "what intensities are divided by", ParameterRange::positive(),
          [](const Context& context) { return context.model.contrast(context.seed); },
          "the distance of the image's two classes of intensities")};
}

/// In the plane with its domain meshes: Alg. 8 on them, but not in the first part of Alg. 17.
template <int Dim>
EnergyKind<Dim> mumford_shah() {
  EnergyKind<Dim> kind{
      "mumford-shah",
      "sum_i 1/2 int_(Omega_i) (u_i - I)^2 + mu |grad u_i|^2 dx + gamma |Gamma|, I by contrast, "
      "(5.4)",
      "A smooth approximation of both sides along with the shape: segments and "
      "denoises at once.",
      mumford_shah_parameters<Dim>()};
  kind.build = [](const KindContext<Dim>& context, const EnergyTerm& term) {
    return context.model.mumford_shah(piecewise_smooth<Dim>(term));
  };
  kind.piecewise_smooth = piecewise_smooth<Dim>;
  kind.coarse = [](const EnergyTerm& term) { return term; };
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
