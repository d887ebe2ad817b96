// From terms to an energy, and what a run asks of the terms together.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "libsurf/energy/energy_sum.h"
#include "libsurf/segment/energy_kind.h"

namespace surf::segment {

/// @throws UsageError  an energy or a parameter is unknown in this dimension or out of its range
template <int Dim>
void check_terms(std::span<const EnergyTerm> terms);

/// The term with the defaults of what is not given.
/// @throws UsageError  there is no such energy
template <int Dim>
EnergyTerm completed(EnergyTerm term, const KindContext<Dim>& context);
template <int Dim>
std::vector<EnergyTerm> completed(std::span<const EnergyTerm> terms,
                                  const KindContext<Dim>& context);

/// The complete terms of a result with one blur, for a level with another one.
template <int Dim>
std::vector<EnergyTerm> at_blur(std::span<const EnergyTerm> terms, double result_blur_mm,
                                double level_blur_mm);

/// The weighted sum.
/// @param terms  complete
/// @throws UsageError  as check_terms; a parameter that has a default is missing
template <int Dim>
std::unique_ptr<energy::EnergySum<Dim>> make_energy(std::span<const EnergyTerm> terms,
                                                    const KindContext<Dim>& context);

/// The fields that a shape has to follow, see EnergyKind::integrands.
/// @param terms  complete
template <int Dim>
std::vector<std::shared_ptr<const Field<Dim>>> integrands(std::span<const EnergyTerm> terms,
                                                          const KindContext<Dim>& context);

/// Whether all do.
template <int Dim>
bool settle_on_edges(std::span<const EnergyTerm> terms);
template <int Dim>
bool take_long_steps(std::span<const EnergyTerm> terms);

/// Of the last term that has one, see EnergyKind; null or nothing if none does.
template <int Dim>
std::shared_ptr<const Field<Dim>> edge_field(std::span<const EnergyTerm> terms,
                                             const KindContext<Dim>& context);
template <int Dim>
std::optional<double> edge_strength(std::span<const EnergyTerm> terms);

/// Of the first term that approximates the image.
/// @param terms  complete
template <int Dim>
std::optional<PiecewiseSmooth> piecewise_smooth(std::span<const EnergyTerm> terms);
/// The same for terms that need not be complete.
template <int Dim>
bool is_piecewise_smooth(std::span<const EnergyTerm> terms);

/// The terms in the first part of Alg. 17; nothing if no kind among them has one.
template <int Dim>
std::optional<std::vector<EnergyTerm>> coarse_terms(std::span<const EnergyTerm> terms);

}  // namespace surf::segment
