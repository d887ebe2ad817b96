// Holes that a flow cannot find from outside, since nothing of the shape is near them.
#pragma once

#include <vector>

#include "libsurf/segment/setting.h"

namespace surf::segment {

template <int Dim>
struct Hole {
  Vector<Dim> center;  ///< [mm]
  double radius_mm;
};

/// Discs or balls inside a shape that its energy would rather have outside. They lie in connected
/// sets of cells where the density of the energy (ShapeEnergy::add_density) is positive, which the
/// shape encloses without touching them, at the deepest place, and are at least about two cells
/// wide. One for each set, by its first cell; O(cells in the shape's box).
/// @param energy  reset to the shape
template <int Dim>
std::vector<Hole<Dim>> find_holes(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                                  const energy::ShapeEnergy<Dim>& energy);

/// The shape with a circle or sphere, normals inward, for each hole by which J decreases. The
/// energy is reset to it. Returns how many there are.
template <int Dim>
int open_holes(const Setting<Dim>& setting, Simplices<Dim>& shape,
               const std::vector<Hole<Dim>>& holes, double edge_length_mm,
               energy::ShapeEnergy<Dim>& energy);

}  // namespace surf::segment
