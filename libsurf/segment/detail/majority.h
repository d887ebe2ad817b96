// What most of several node sets agree on.
#pragma once

#include <span>

#include "libsurf/segment/node_set.h"

namespace surf::segment {

/// The nodes of the box that sets with more than half of the sum of all weights have: of all sets
/// that which has the greatest sum of weights times nodes in which it and they agree.
/// @param sets     of one box
/// @param weights  one for each, not negative
template <int Dim>
NodeSet<Dim> majority(std::span<const NodeSet<Dim>* const> sets, std::span<const double> weights);

}  // namespace surf::segment
