// Cavities that a flow cannot find from outside, since nothing of the surface is near them.
#pragma once

#include <vector>

#include "libsurf/energy/shape_energy.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

struct Hole {
  Eigen::Vector3d center;  ///< [mm, RAS]
  double radius_mm;
};

/// Balls inside a surface that its energy would rather have outside. They lie in connected sets of
/// voxels where the density of the energy (ShapeEnergy::add_density) is positive, which the surface
/// encloses without touching them, at the deepest place, and are at least about two voxels wide.
/// One for each set, by its first voxel; O(voxels in the surface's box).
/// @param energy  reset to the surface
std::vector<Hole> find_holes(const Triangles& surface, const energy::ShapeEnergy<3>& energy,
                             const volume::Volume& volume);

/// The surface with a sphere, normals inward, for each hole by which J decreases. The energy is
/// reset to it. Returns how many there are.
int open_holes(Triangles& surface, const std::vector<Hole>& holes, double edge_length_mm,
               energy::ShapeEnergy<3>& energy);

}  // namespace surf::segment
