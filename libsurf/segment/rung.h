// A region of a search grid and what its boundary looks like.
#pragma once

#include <cmath>

#include "libsurf/segment/node_set.h"
#include "libsurf/segment/rung_features.h"
#include "libsurf/segment/search_grid.h"

namespace surf::segment {

/// Where a region comes from; of windows which nodes one of half-width a holds, I being the
/// intensity and m the seeds' means. The first click tries windows I <= m + a no more: of 40
/// structures none was found better by them.
enum class Family : std::uint8_t {
  kAlike,        ///< |I - m| <= a for one of the means
  kBrighter,     ///< I >= least m - a: as bright, or brighter
  kDarker,       ///< I <= greatest m + a
  kBetween,      ///< least m - a <= I <= greatest m + a
  kFront,        ///< what a front from the seeds, slow on edges, reaches first
  kCompetition,  ///< what such a front reaches before those of other clicks
  kNeck,         ///< what a neck parts from the other clicks
  kBall,         ///< a ball
  kCut,          ///< a least cut between all clicks
};

template <int Dim>
struct Rung {
  Family family = Family::kAlike;
  double half_width = 0, neck_radius = 0;  ///< [intensity], of fronts and competition [1]; [nodes]
  NodeSet<Dim> inside;  ///< its box leaves a margin, but at the border of the grid
  std::size_t n_nodes = 0;
  RungFeatures features;
  double border_share = 0;  ///< of the length or area
  double score = 0;
  double kept = 1;  ///< Dice with what it was before it settled
};

/// Fills in what the boundary of the nodes inside looks like, which are given.
/// @param level  of the nodes of the grid
/// @param edge   nodes of the grid that lie on edges
template <int Dim>
void measure(const NodeBox<Dim>& grid, const std::vector<std::uint16_t>& level,
             const NodeSet<Dim>& edge, Rung<Dim>& rung);

/// What boundary and growth say of a rung of a ladder: as of the formula of RungFeatures, but what
/// the scan cuts off is less likely to be meant, of two that are equal the larger one is, and the
/// separation counts for more. It says which are worth settling.
template <int Dim>
double ladder_score(const Rung<Dim>& rung);

/// How much the boundary of a settled rung looks like that of an object:
///
///   separation^1.5 * edge share * sphericity^0.15 * diameter^0.2 * exp(-border share)
template <int Dim>
double boundary_score(const Rung<Dim>& rung);

/// Which settled rung is meant:
///
///   boundary_score * growth_out^0.75 * exp(-growth_in / 5) * depth_share^0.6 * (1 alike and cut;
///   0.9 brighter; 0.55 all others)
///
/// the growth being that of its ladder. Settled boundaries lie on edges, so that they tell more
/// than those of windows do, and roundness less. See docs/method.md for how the exponents were
/// found.
/// @param depth_share  depth of the seeds over the greatest depth, up to 1
template <int Dim>
double settled_score(const Rung<Dim>& rung, double depth_share);

/// No less than settled_score() of what becomes of a rung by settling, if nothing cuts it off and
/// it has no more than 30 times the nodes then.
template <int Dim>
double most_settled_score(const Rung<Dim>& rung);

/// Dice.
template <int Dim>
double overlap(const Rung<Dim>& a, const Rung<Dim>& b);

/// The rungs of best score, best first, of which no two have more than most_overlap (Dice) in
/// common; none whose score is not positive.
template <int Dim>
std::vector<const Rung<Dim>*> differing(std::vector<const Rung<Dim>*> rungs, std::size_t n_most,
                                        double most_overlap);

}  // namespace surf::segment
