#include "libsurf/segment/verdict.h"

#include <cmath>

#include "libsurf/segment/change.h"
#include "libsurf/segment/object_box.h"

namespace surf::segment {
namespace {

constexpr int kMargin = 3;           // nodes, for the shell
constexpr double kCalmDepth = 0.75;  // as of region_search.cpp

}  // namespace

template <int Dim>
VerdictFeatures verdict_features(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search) {
  const SeedView<Dim> view(grid, {search.on_grid.front().seed}, search.noise);
  Rung<Dim> region;
  region.box = bounds(grid.box(), search.inside, kMargin);
  const Flags inside = cropped(grid.box(), search.inside, region.box);
  measure(inside, cropped(grid.box(), grid.level(), region.box),
          cropped(grid.box(), view.edge, region.box), region);
  VerdictFeatures out;
  out.separation = region.features.separation;
  out.edge_share = region.features.edge_share;
  out.sphericity = region.features.sphericity;
  out.border_share = region.border_share;
  out.depth_share =
      depths_of<Dim>(grid.box(), region.box, inside, search.on_grid.front().seed.nodes)
          .share(kCalmDepth);
  out.contest = search.contest;
  out.n_clicks = double(search.clicks.size());
  out.has_box = grid.has_outside_faces();
  out.box_fit = box_fit(grid, bounds(grid.box(), search.inside, 0));
  return out;
}

template VerdictFeatures verdict_features<2>(const SearchGrid<2>&, const ClickSearch<2>&);
template VerdictFeatures verdict_features<3>(const SearchGrid<3>&, const ClickSearch<3>&);

}  // namespace surf::segment
