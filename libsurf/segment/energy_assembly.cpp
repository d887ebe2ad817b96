#include "libsurf/segment/energy_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/nearest_name.h"

namespace surf::segment {
namespace {

constexpr int other(int dimension) { return dimension == 2 ? 3 : 2; }

/// Null if there is no such kind, or it has no such parameter.
template <int Dim>
const KindParameter<Dim>* find_parameter(const std::string& kind, const std::string& key) {
  for (const EnergyKind<Dim>* k : all_kinds<Dim>())
    if (k->name == kind) return k->find_parameter(key);
  return nullptr;
}

template <int Dim>
[[noreturn]] void refuse_key(const EnergyKind<Dim>& kind, const std::string& key) {
  std::vector<std::string> keys;
  for (const KindParameter<Dim>& parameter : kind.parameters) keys.push_back(parameter.key);
  if (find_parameter<other(Dim)>(kind.name, key))
    throw UsageError(fmt::format("energy {}: parameter '{}' is there for {} only", kind.name, key,
                                 Dim == 2 ? "volumes" : "images"));
  throw UsageError(fmt::format("energy {}: parameter '{}' is unknown{}", kind.name, key,
                               did_you_mean(key, keys)));
}

template <int Dim>
void check_term(const EnergyTerm& term) {
  const EnergyKind<Dim>& kind = find_kind<Dim>(term.name);
  if (!std::isfinite(term.weight))
    throw UsageError(fmt::format("energy {}: weight {} is not a number", term.name, term.weight));
  for (const auto& [key, value] : term.parameters) {
    const KindParameter<Dim>* known = kind.find_parameter(key);
    if (!known) refuse_key(kind, key);
    if (!known->range.contains(value))
      throw UsageError(
          fmt::format("energy {}: {} = {} {}", term.name, key, value,
                      std::isfinite(value) ? known->range.violation() : "is not a number"));
  }
}

template <int Dim>
void check_complete(const EnergyTerm& term) {
  for (const KindParameter<Dim>& known : find_kind<Dim>(term.name).parameters)
    if (!known.standard.is_absent()) parameter(term, known.key);
}

template <int Dim>
std::unique_ptr<energy::ShapeEnergy<Dim>> build(const EnergyTerm& term,
                                                const KindContext<Dim>& context) {
  check_term<Dim>(term);
  check_complete<Dim>(term);
  auto energy = find_kind<Dim>(term.name).build(context, term);
  if (!energy) throw UsageError(fmt::format("energy {}: its kind has built nothing", term.name));
  return energy;
}

/// The last term whose kind has this property; null if there is none.
template <int Dim, class Property>
const EnergyTerm* last_with(std::span<const EnergyTerm> terms, Property property) {
  const auto at = std::find_if(terms.rbegin(), terms.rend(), [&](const EnergyTerm& term) {
    return bool(find_kind<Dim>(term.name).*property);
  });
  return at == terms.rend() ? nullptr : &*at;
}

}  // namespace

template <int Dim>
void check_terms(std::span<const EnergyTerm> terms) {
  for (const EnergyTerm& term : terms) check_term<Dim>(term);
}

template <int Dim>
EnergyTerm completed(EnergyTerm term, const KindContext<Dim>& context) {
  for (const KindParameter<Dim>& known : find_kind<Dim>(term.name).parameters) {
    if (known.standard.is_absent() || term.parameters.contains(known.key)) continue;
    const double value =
        known.standard.constant ? *known.standard.constant : known.standard.choice(context, term);
    term.parameters[known.key] = value;
  }
  return term;
}

template <int Dim>
std::vector<EnergyTerm> completed(std::span<const EnergyTerm> terms,
                                  const KindContext<Dim>& context) {
  std::vector<EnergyTerm> out;
  for (const EnergyTerm& term : terms) out.push_back(completed<Dim>(term, context));
  return out;
}

template <int Dim>
std::vector<EnergyTerm> at_blur(std::span<const EnergyTerm> terms, double result_blur_mm,
                                double level_blur_mm) {
  std::vector<EnergyTerm> out(terms.begin(), terms.end());
  for (EnergyTerm& term : out)
    for (const KindParameter<Dim>& known : find_kind<Dim>(term.name).parameters)
      if (known.blur_power != 0 && term.parameters.contains(known.key))
        term.parameters[known.key] *= std::pow(result_blur_mm / level_blur_mm, -known.blur_power);
  return out;
}

template <int Dim>
std::unique_ptr<energy::EnergySum<Dim>> make_energy(std::span<const EnergyTerm> terms,
                                                    const KindContext<Dim>& context) {
  auto sum = std::make_unique<energy::EnergySum<Dim>>();
  for (const EnergyTerm& term : terms) sum->add(term.weight, build<Dim>(term, context));
  return sum;
}

template <int Dim>
std::vector<std::shared_ptr<const Field<Dim>>> integrands(std::span<const EnergyTerm> terms,
                                                          const KindContext<Dim>& context) {
  std::vector<std::shared_ptr<const Field<Dim>>> out;
  for (const EnergyTerm& term : terms) {
    const EnergyKind<Dim>& kind = find_kind<Dim>(term.name);
    if (!kind.integrands) continue;
    for (auto& field : kind.integrands(context, term)) out.push_back(std::move(field));
  }
  return out;
}

template <int Dim>
bool settle_on_edges(std::span<const EnergyTerm> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const EnergyTerm& term) {
    return find_kind<Dim>(term.name).settles_on_edges;
  });
}

template <int Dim>
bool are_fitted(std::span<const EnergyTerm> terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const EnergyTerm& term) { return find_kind<Dim>(term.name).is_fitted; });
}

template <int Dim>
bool take_long_steps(std::span<const EnergyTerm> terms) {
  return std::all_of(terms.begin(), terms.end(), [](const EnergyTerm& term) {
    return find_kind<Dim>(term.name).takes_long_steps;
  });
}

template <int Dim>
std::shared_ptr<const Field<Dim>> edge_field(std::span<const EnergyTerm> terms,
                                             const KindContext<Dim>& context) {
  const EnergyTerm* term = last_with<Dim>(terms, &EnergyKind<Dim>::edge_field);
  return term ? find_kind<Dim>(term->name).edge_field(context, *term) : nullptr;
}

template <int Dim>
std::optional<double> edge_strength(std::span<const EnergyTerm> terms) {
  const EnergyTerm* term = last_with<Dim>(terms, &EnergyKind<Dim>::edge_strength);
  if (!term) return std::nullopt;
  return find_kind<Dim>(term->name).edge_strength(*term);
}

template <int Dim>
std::optional<PiecewiseSmooth> piecewise_smooth(std::span<const EnergyTerm> terms) {
  for (const EnergyTerm& term : terms)
    if (const auto& of = find_kind<Dim>(term.name).piecewise_smooth) return of(term);
  return std::nullopt;
}

template <int Dim>
bool is_piecewise_smooth(std::span<const EnergyTerm> terms) {
  return last_with<Dim>(terms, &EnergyKind<Dim>::piecewise_smooth) != nullptr;
}

template <int Dim>
std::optional<std::vector<EnergyTerm>> coarse_terms(std::span<const EnergyTerm> terms) {
  if (!last_with<Dim>(terms, &EnergyKind<Dim>::coarse)) return std::nullopt;
  std::vector<EnergyTerm> out;
  for (const EnergyTerm& term : terms) {
    const auto& coarse = find_kind<Dim>(term.name).coarse;
    out.push_back(coarse ? coarse(term) : term);
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                                    \
  template void check_terms<Dim>(std::span<const EnergyTerm>);                                   \
  template EnergyTerm completed<Dim>(EnergyTerm, const KindContext<Dim>&);                       \
  template std::vector<EnergyTerm> completed<Dim>(std::span<const EnergyTerm>,                   \
                                                  const KindContext<Dim>&);                      \
  template std::vector<EnergyTerm> at_blur<Dim>(std::span<const EnergyTerm>, double, double);    \
  template std::unique_ptr<energy::EnergySum<Dim>> make_energy<Dim>(std::span<const EnergyTerm>, \
                                                                    const KindContext<Dim>&);    \
  template std::vector<std::shared_ptr<const Field<Dim>>> integrands<Dim>(                       \
      std::span<const EnergyTerm>, const KindContext<Dim>&);                                     \
  template bool settle_on_edges<Dim>(std::span<const EnergyTerm>);                               \
  template bool are_fitted<Dim>(std::span<const EnergyTerm>);                                    \
  template bool take_long_steps<Dim>(std::span<const EnergyTerm>);                               \
  template std::shared_ptr<const Field<Dim>> edge_field<Dim>(std::span<const EnergyTerm>,        \
                                                             const KindContext<Dim>&);           \
  template std::optional<double> edge_strength<Dim>(std::span<const EnergyTerm>);                \
  template std::optional<PiecewiseSmooth> piecewise_smooth<Dim>(std::span<const EnergyTerm>);    \
  template bool is_piecewise_smooth<Dim>(std::span<const EnergyTerm>);                           \
  template std::optional<std::vector<EnergyTerm>> coarse_terms<Dim>(std::span<const EnergyTerm>);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
