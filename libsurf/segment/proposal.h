// Shapes to start from, proposed round clicks.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "libsurf/segment/click_search.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

/// A start, never a result: it says which object is meant.
template <int Dim>
struct Proposal {
  Simplices<Dim> shape;     ///< closed, embedded, in the box of the cells' centres
  double score, enclosed;   ///< larger is better; [mm^Dim]
  Family family;            ///< of the windows it comes from
  double mean, half_width;  ///< middle and half of Region's low and high [intensity]
  double neck_radius_mm;    ///< of the opening
  double node_mm;           ///< of the grid: how far off its boundary may be
  RungFeatures features;    ///< what the boundary looks like
  std::size_t place = 0;    ///< in ClickSearch::found
  std::size_t n_clicks = 1;
};

/// "intensities between 12 and 250, cut off where a neck is thinner than 3 mm, settled on the edges
/// near by; score 0.82"
template <int Dim>
std::string to_string(const Proposal<Dim>& proposal);

/// What the search looks at, made once for an image; its nodes are not made yet.
/// @param options  their Gaussian is replaced by that of the grid unless `sigma_mm` is given
/// @param box_mm   that the object lies in: nothing beyond it is looked at
/// @throws UsageError  see cells_of_box
template <int Dim>
SearchGrid<Dim> search_grid(const Setting<Dim>& setting, FieldOptions options,
                            std::optional<double> sigma_mm = {},
                            const std::optional<BoxCorners<Dim>>& box_mm = {},
                            double max_nodes = SearchOptions().max_nodes);

/// Where the blurred share of a set of the grid's nodes is one half; it may intersect itself.
template <int Dim>
Simplices<Dim> boundary(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                        const NodeSet<Dim>& nodes);

/// A region while it is looked at, to be shown; it may intersect itself.
template <int Dim>
Simplices<Dim> preview(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                       const Rung<Dim>& rung);

/// What clicks have found, as shapes, best first; those whose boundary cannot be made a sound shape
/// are left out. Empty: no object stands out round the first click.
template <int Dim>
std::vector<Proposal<Dim>> proposals(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                     const ClickSearch<Dim>& search);

}  // namespace surf::segment
