// What clicks have found on a search grid, one after the other.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "libsurf/segment/correction.h"
#include "libsurf/segment/region_search.h"

namespace surf::segment {

/// How much candidates agree with the chosen one: the mean of their Dice with it, by their scores.
/// @param scores    of all, the chosen one's among them; not all 0
/// @param overlaps  their Dice with the chosen one
double consent_of(std::span<const double> scores, std::span<const double> overlaps);

/// What the first clicks of an object have found. Immutable; a further click makes a new one from
/// it, so that the same clicks in the same order, with the same evolutions between them, end at the
/// same, to the bit, whenever they were made.
template <int Dim>
struct ClickSearch {
  std::vector<Click<Dim>> clicks;
  std::vector<GridClick<Dim>> on_grid;  ///< in the order in which they were heeded
  /// Of the inside click that is looked for as the first one, best first; never null.
  std::shared_ptr<const std::vector<SettledRegion<Dim>>> first;
  double noise = 0;               ///< [intensity per node]
  NodeBox<Dim> box;               ///< of the grid
  std::vector<Rung<Dim>> found;   ///< by the last click, best first; few
  std::size_t chosen = 0;         ///< of them
  bool has_evolved = false;       ///< the chosen one is what has become of it
  std::optional<double> consent;  ///< of the last corrections that say enough
  bool says_little = false;       ///< the last click changed too little to judge the object anew
  /// Whether EvolvedOf was asked before this click or an earlier one: options have a say in that.
  bool has_asked = false;
  std::shared_ptr<const ClickSearch> before;  ///< one click or evolution less; null at the first

  /// Of the chosen one, in the box of the grid; in no box if nothing was found.
  NodeSet<Dim> inside() const;
};

template <int Dim>
using ClickSearchPointer = std::shared_ptr<const ClickSearch<Dim>>;

/// Asked before a click that what was found has on its side already: who clicks there has seen what
/// became of it. with_evolved() of what was found, or null: go on from that itself.
template <int Dim>
using EvolvedOf = std::function<ClickSearchPointer<Dim>(const ClickSearchPointer<Dim>& found,
                                                        const Click<Dim>& next)>;

/// Heeds the clicks in their order. The first inside one is looked for near it, then in the
/// whole grid (region_search.h), each further one changes what has been found (correction.h);
/// outside clicks that come before it are heeded after it. Where nothing is found round it the next
/// inside one is the first, and those before are heeded after it. So is a second one after a first
/// alone, if nothing comes of it as a correction but a crumb that hangs on nothing, or a part that
/// goes on beyond the surroundings and of which its region has nine tenths; if that does not answer
/// the first one, either, both regions are one. A click of which nothing comes leaves all as it is.
///
/// @param known  of the same grid, or null: what it and those before it have in common with the
///               clicks is taken over
/// @return  null after a stop, or if there is no inside click; `found` is empty if nothing stands
///          out round any of the inside ones
template <int Dim>
ClickSearchPointer<Dim> search_clicks(const SearchGrid<Dim>& grid,
                                      std::span<const Click<Dim>> clicks,
                                      ClickSearchPointer<Dim> known = nullptr,
                                      const SearchOptions& options = {},
                                      const SearchProgress<Dim>& progress = {},
                                      const std::stop_token& stop = {},
                                      const EvolvedOf<Dim>& evolved = {});

/// The same with another of those that were found; further clicks start from it.
template <int Dim>
ClickSearchPointer<Dim> with_choice(const ClickSearch<Dim>& search, std::size_t chosen);

/// The same after a shape has evolved from what was found, which takes the place of the chosen one:
/// further clicks correct that.
/// @param inside  the nodes inside it, on the box of the grid; at least one
/// @pre  something was found
template <int Dim>
ClickSearchPointer<Dim> with_evolved(const ClickSearchPointer<Dim>& search,
                                     const NodeSet<Dim>& inside);

/// The same with the regions of one before it: the clicks since then have changed nothing.
template <int Dim>
ClickSearchPointer<Dim> with_regions(const ClickSearch<Dim>& search,
                                     const ClickSearch<Dim>& before);

/// The last one before anything evolved; it and those before it depend on their clicks alone, but
/// for what has_asked says.
template <int Dim>
ClickSearchPointer<Dim> before_evolutions(ClickSearchPointer<Dim> search);

/// The last one that both go on from, or are; null if there is none.
template <int Dim>
const ClickSearch<Dim>* common_start(const ClickSearch<Dim>* a, const ClickSearch<Dim>* b);

/// Those that were found, best first.
template <int Dim>
std::vector<Region<Dim>> regions(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search);

}  // namespace surf::segment
