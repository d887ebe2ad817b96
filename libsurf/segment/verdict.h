// How far a result is to be trusted.
#pragma once

#include <optional>
#include <string>

#include "libsurf/segment/click_search.h"

namespace surf::segment {

/// What is known of a chosen region without a reference.
struct VerdictFeatures {
  double separation = 0, edge_share = 0, sphericity = 0;  ///< RungFeatures
  double border_share = 0;                                ///< of the area on the image's border
  double depth_share = 0;  ///< of the first click, over 0.75 of the greatest depth
  Contest contest;
  double n_clicks = 1;
  bool has_box = false;
  double box_fit = 1;
};

/// Of the region that is chosen.
template <int Dim>
VerdictFeatures verdict_features(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search);

}  // namespace surf::segment
