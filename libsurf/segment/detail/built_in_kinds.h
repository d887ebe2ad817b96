// The energy kinds that the library brings along, by family.
#pragma once

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
