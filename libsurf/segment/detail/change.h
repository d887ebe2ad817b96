// What a change of an object on a search grid looks like: nodes that a click adds or takes away.
#pragma once

#include <cstdint>
#include <vector>

#include "libsurf/segment/click.h"
#include "libsurf/segment/rung.h"

namespace surf::segment {

/// Of the faces of a piece: those between it and what it joins or is cut from are its seam, the
/// others become part of the object's new boundary.
struct ChangeFeatures {
  double n_nodes = 0;
  double n_faces = 0;         ///< all
  double n_free = 0;          ///< of the new boundary
  double n_free_on_edge = 0;  ///< of these, on nodes on edges
  double n_border = 0;        ///< on the border of the box
  double separation = 0;      ///< of the piece from the shell of 2 nodes beyond its free faces

  /// How much an addition or a removal looks like an object of its own:
  ///
  ///   added:   separation^1.3 (n_free_on_edge + 1/2) / (n_free + 1) exp(-n_border / n_faces)
  ///   removed: (1 - (n_free - n_free_on_edge) / n_faces)^2 max(separation, 0.6)^1.3
  ///
  /// A part that is taken away often has the intensities of what stays: then only the length of the
  /// cut tells.
  double score(Side side) const;
};

/// @param piece   added (kInside; none of `before`) or taken away (kOutside; of `before`); its box
///                leaves it a margin of 3 nodes where the grid has one
/// @param level   of the nodes of the grid
/// @param edge    nodes of the grid that lie on edges
template <int Dim>
ChangeFeatures measure_change(const NodeBox<Dim>& grid, const NodeSet<Dim>& piece,
                              const NodeSet<Dim>& before, Side side,
                              const std::vector<std::uint16_t>& level, const NodeSet<Dim>& edge);

/// Number of nodes of the largest part that is connected along the axes.
template <int Dim>
std::size_t largest_component(const NodeSet<Dim>& nodes);

/// Distance to the outside, from the nodes' centres [nodes], of the deepest of some nodes and of
/// the deepest node of all.
struct Depths {
  double at_nodes = 0, greatest = 0;
  /// (at_nodes + 0.7) / (share * greatest), at most 1: 0.7 for the rounding of both to whole nodes.
  double share(double of_greatest = 1) const;
};

/// @param grid    beyond its border is outside, but along axes of few slices
/// @param inside  in a box with a margin of a node where the grid has one
template <int Dim>
Depths depths_of(const NodeBox<Dim>& grid, const NodeSet<Dim>& inside,
                 std::span<const typename NodeBox<Dim>::Index> nodes);

/// No less than depths_of(grid, inside, nodes).share(), in a sixth of its time: of the nodes the
/// way out along the axes, of the deepest node that of the cells of 4 nodes along each axis which
/// are inside as a whole.
template <int Dim>
double most_share(const NodeSet<Dim>& inside, std::span<const typename NodeBox<Dim>::Index> nodes);

}  // namespace surf::segment
