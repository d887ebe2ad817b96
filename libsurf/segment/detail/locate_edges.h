// Where the edge is along a shape, and how sure.
#pragma once

#include <stop_token>

#include "libsurf/segment/certainty.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

template <int Dim>
struct LocatedEdges {
  Points<Dim> points;        ///< where the vertices belong: those without an edge stay
  Certainty<Dim> certainty;  ///< if they go there
  double length_mm = 0;      ///< below which the shape is taken for smooth, as the image tells
  double blur_mm = 0;        ///< median width of the steps
  double noise = 0;          ///< median deviation of the cells [intensity]
  double correlation = 1;    ///< cells that tell as much as one with noise of its own, >= 1
  bool was_stopped = false;  ///< nothing of it holds then
};

/// Fits a blurred step across the shape to the cells beside it.
///
/// @param blur_mm  about that of the edges: cells are looked at up to a few times as far, and where
///                 it is several cells wide blocks of them
/// @param is_held  of a part of a shape: the vertices that others need where they are; empty = the
///                 shape is whole
/// @param stop  heard between factorisations and passes
template <int Dim>
LocatedEdges<Dim> locate_edges(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                               double blur_mm, const std::vector<char>& is_held = {},
                               const std::stop_token& stop = {});

}  // namespace surf::segment
