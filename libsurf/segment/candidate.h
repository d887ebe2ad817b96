// What else the clicks may mean: the next best proposals of each of them.
#pragma once

#include <string>
#include <vector>

#include "libsurf/segment/proposal.h"

namespace surf::segment {

/// A proposal, and the click that it answers together with those before it.
template <int Dim>
struct Candidate {
  Proposal<Dim> proposal;
  Click<Dim> click;
  std::size_t n_click = 1;  ///< of ClickSearch::clicks, from 1
  std::size_t rank = 1;     ///< 1 = the best of that click
  bool is_chosen = false;   ///< what the next click, or the evolution, went on from
};

/// Those of the last click first, the best first; then those of the click before it, and so on.
/// Clicks that changed nothing have none. O(nodes) for each.
template <int Dim>
std::vector<Candidate<Dim>> candidates(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                       const ClickSearch<Dim>& search);

/// "click 2, inside (3, 4, 5) mm, rank 1, chosen: 12.3 ml, what 2 clicks leave, ...; score 0.82"
template <int Dim>
std::string to_string(const Candidate<Dim>& candidate);

}  // namespace surf::segment
