// The energy kinds that the library brings along, by family.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "libsurf/segment/energy_kind.h"

namespace surf::segment {

/// What looks for edges.
template <int Dim>
std::vector<EnergyKind<Dim>> edge_kinds();

/// What looks at the shape alone, or at its normals.
template <int Dim>
std::vector<EnergyKind<Dim>> shape_kinds();

/// What looks at the intensities of both sides.
template <int Dim>
std::vector<EnergyKind<Dim>> region_kinds();

/// A parameter whose default the image and the seeds give.
/// @param text  says what is chosen
template <int Dim>
KindParameter<Dim> chosen_parameter(std::string key, std::string unit, std::string meaning,
                                    ParameterRange range,
                                    std::function<double(const KindContext<Dim>&)> choice,
                                    std::string text, double blur_power = 0) {
  const auto of_term = [choice = std::move(choice)](const KindContext<Dim>& context,
                                                    const EnergyTerm&) { return choice(context); };
  return {std::move(key),
          std::move(unit),
          std::move(meaning),
          std::move(range),
          ParameterDefault<Dim>::chosen(of_term, std::move(text)),
          blur_power};
}

/// lambda of the edge indicator; by default estimate_edge_strength round the seeds.
template <int Dim>
KindParameter<Dim> lambda_parameter();

/// That of a ball, or of a plane; 0 by default.
template <int Dim>
KindParameter<Dim> curvature_parameter();

/// The edge indicator of the term's `lambda`, if it has one.
template <int Dim>
std::vector<std::shared_ptr<const Field<Dim>>> edge_integrands(const KindContext<Dim>& context,
                                                               const EnergyTerm& term);

}  // namespace surf::segment
