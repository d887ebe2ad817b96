// A further click: what of an object on a search grid it changes.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/pieces.h"
#include "libsurf/segment/region_search.h"

namespace surf::segment {

/// An object after a click.
template <int Dim>
struct Correction {
  NodeSet<Dim> inside;    ///< outside its box nothing has changed
  Family family;          ///< of the piece, or of the region of the first click
  bool is_whole = false;  ///< a region of the first click in place of the object
  double score = 0;       ///< to compare corrections by one click
  double kept = 1;        ///< Dice of the change with what it was before it settled
};

/// Of the pieces (pieces.h) the ten that differ and score best by
///
///   change.score * C^2 * growth_out * exp(-growth_in / 4),
///   C = (depth of the click in the piece + 0.7) / greatest depth of the piece
///
/// are added to the object (closed by a node near the piece, holes filled) or taken away, and
/// settle on the edges within 3.5 nodes of the change (settle_cut.h); all else stays. With two cuts
/// between all clicks (click_cut.h), settled as well, and up to eight regions of the first click
/// that obey all clicks they are scored by the change that they really make, P being its part with
/// the click:
///
///   sqrt(change.score(P) * boundary_score(T)) * C(P)^2 * (share of P in the change)^0.5
///     * c(T)^0.3 * growth * n(T)^(1.05 / Dim) * agreement^0.25
///
/// where C(P) >= 0.55, c is the depth of the first click in T over 0.75 of the greatest one, n the
/// number of nodes, growth that of the piece's ladder (0 where an addition that hangs on nothing
/// has no other nodes than those held round the click), and agreement the mean Dice of this change
/// and the others. What those with a Dice of 0.7 or more with the best one have inside by more than
/// half of all their scores squared takes its place. See docs/clicks.md for what was tried.
///
/// O(ladders) as in search_rungs(), in the surroundings of object and clicks alone.
///
/// @param before  the object, in the box of the grid
/// @param clicks  in their order; the last is the one to heed, the first inside one made the object
/// @param noise   that of the first click [intensity per node]
/// @return  best first; at least one, whose clicks are all on their sides. If nothing comes of the
///          click but what is held round it, that alone, with a score of 0
template <int Dim>
std::vector<Correction<Dim>> corrections(const SearchGrid<Dim>& grid, const NodeSet<Dim>& before,
                                         std::span<const GridClick<Dim>> clicks,
                                         std::span<const SettledRegion<Dim>> first, double noise,
                                         const std::stop_token& stop = {});

}  // namespace surf::segment
