// A box that a person has drawn round an object.
#pragma once

#include <array>

#include "libsurf/segment/click.h"
#include "libsurf/segment/node_set.h"
#include "libsurf/segment/search_grid.h"

namespace surf::segment {

/// The cells of a box, as far as the image goes.
/// @throws UsageError  a corner is not finite, no cell of the image is in the box, or it is thinner
///                     than 3 cells along an axis along which the image is not
template <int Dim>
NodeBox<Dim> cells_of_box(const ImageExtent<Dim>& extent, const BoxCorners<Dim>& corners_mm);

/// Opposite corners of the least box along the image's axes that holds the one along those of the
/// world with these; the same ones where the axes are the same. In an oblique image two corners
/// that a viewer shows in world coordinates are no opposite ones along its axes: a ball whose box
/// they were ended in a slab a few voxels thick.
template <int Dim>
BoxCorners<Dim> holding_box_along_world(const ImageBox<Dim>& image,
                                        const BoxCorners<Dim>& corners_mm);

/// Whether a point is in one of the cells.
template <int Dim>
bool is_in_cells(const ImageExtent<Dim>& extent, const NodeBox<Dim>& cells,
                 const Vector<Dim>& point_mm);

/// The nodes of the faces beyond which the object cannot be; empty if there is none.
template <int Dim>
NodeSet<Dim> outside_faces(const SearchGrid<Dim>& grid);

/// How well an object fits the box that was drawn round it, from 0 to 1: people leave a margin of a
/// centimetre or two.
///
///   exp(-near - min(far, 1.6)),  near = sum max(0, 8 mm - gap)^2 / (2 (4 mm)^2),
///                                far = sum max(0, gap - 22 mm)^2 / (2 (25 mm)^2)
///
/// over the gaps to the faces beyond which the object cannot be; 1 if there is none. What reaches a
/// face has nearly always leaked; what stays far from one may be a part of the object. Along an
/// axis along which the box is shorter than 40 mm the lengths are, too; and what is as near to all
/// faces, and no nearer than two nodes, is so because the box was drawn close: of each face's share
/// of `near` the least counts for none.
/// @param object  the box of its nodes, without a margin
template <int Dim>
double box_fit(const SearchGrid<Dim>& grid, const NodeBox<Dim>& object);

}  // namespace surf::segment
