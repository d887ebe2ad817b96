// Strokes painted into a label map of the image, as Slicer and ITK-SNAP paint them.
#pragma once

#include <span>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/segment/click.h"

namespace surf::segment {

/// Of one stroke; where it has more cells, blocks of 2, 3, ... of them along each axis are
/// represented by one.
constexpr std::size_t kMostPointsOfStroke = 1000;

/// The connected parts of label 1 (inside) and of label 2 (outside), corners included, as one click
/// each: its point is the cell nearest to the stroke's centre. Inside strokes come before outside
/// ones, larger ones before smaller, then as the cells are counted. O(cells).
///
/// @param image   the grid of the labels
/// @param labels  of its cells, first index fastest
/// @throws InputError  a label is none of 0, 1 and 2, or no cell is marked
template <int Dim>
std::vector<Click<Dim>> strokes(const ImageBox<Dim>& image, std::span<const float> labels);

/// @throws InputError  the marks are on another grid: another size, or a corner is off by more than
///                     1e-3 cells; says both geometries
template <int Dim>
void check_same_grid(const ImageBox<Dim>& image, const ImageBox<Dim>& marks);

}  // namespace surf::segment
