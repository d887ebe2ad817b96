// A shape that stays as it is but for where a further click has changed the region.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "libsurf/mesh/neighbourhood.h"
#include "libsurf/segment/click.h"
#include "libsurf/segment/node_set.h"
#include "libsurf/segment/search_grid.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

template <int Dim>
struct Amended {
  Simplices<Dim> shape;
  /// Where it is not yet at its minimum.
  std::shared_ptr<const mesh::Neighbourhood<Dim>> region;
  double changed = 0;  ///< content of the cells that the change has [mm^Dim]
};

/// What an evolution ended at, and what clicks have changed since then.
template <int Dim>
struct Amendment {
  const Simplices<Dim>& shape;
  double reach_mm;                 ///< of the boundary of `before`, in which the shape is
  NodeSet<Dim> before, after;      ///< on the search grid
  std::vector<Click<Dim>> clicks;  ///< that are new
};

/// Whether further clicks correct this shape, which has come to rest, and amend it. Small ones they
/// do not: there a click corrects the region that the shape came from, as it does where all clicks
/// are given at once, and what comes of it evolves anew. That takes 1.4 times as long and leaves no
/// seams, which in the end cost 0.01 in Dice (docs/clicks.md).
template <int Dim>
bool is_amended(const Simplices<Dim>& settled);

/// What is changed further from the boundary than the nodes beside it, or where a new click is, and
/// what is near that. A region that settles anew ends a node beside the shape in many places, which
/// is no reason to let all of a shape that has come to rest move again.
template <int Dim>
NodeSet<Dim> change_that_counts(const SearchGrid<Dim>& grid, const Amendment<Dim>& amendment);

/// The shape with what was added and without what went: shells of these, which reach further into
/// and out of it than it may be from the region's boundary, are joined to it, and where they cross
/// it becomes the boundary of the domain round which they wind (surgery.h). All else stays, bit for
/// bit. Where more than half of the shape would move again, what counts of the change is made
/// alone.
///
/// @param options  of the shape, as it goes on from there
/// @return  nothing if so much has changed that nothing is gained, or no sound shape comes of it
template <int Dim>
std::optional<Amended<Dim>> amended(const Setting<Dim>& setting, const SearchGrid<Dim>& grid,
                                    const Amendment<Dim>& amendment,
                                    mesh::MovingShapeOptions<Dim> options);

}  // namespace surf::segment
