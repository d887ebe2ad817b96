// The first click: what is round it is looked at before the whole image.
#pragma once

#include "libsurf/segment/region_search.h"

namespace surf::segment {

/// search_rungs() in cubes of 49 and 73 nodes round the seed, then in the whole grid. A cube has
/// the last word if the best of its regions scores 0.7 or more and ends within it, and no other one
/// that reaches a face of the cube would be better had that not cut it off: if
///
///   score > score' exp(border share')
///
/// for all of these, which are left out then. So a small object takes the time of a small image,
/// and what is far away does not compete with it (docs/method.md).
///
/// In the plane, and with a box round the object, all of the grid is searched at once.
///
/// @param seed  world mm, in the image
template <int Dim>
SearchedRegions<Dim> search_outward(const SearchGrid<Dim>& grid, const Vector<Dim>& seed,
                                    const SearchOptions& options = {},
                                    const SearchProgress<Dim>& progress = {},
                                    const std::stop_token& stop = {});

}  // namespace surf::segment
