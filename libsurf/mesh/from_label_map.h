// Triangle surfaces of labels and levels of a volume.
#pragma once

#include <optional>

#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surf::mesh {

/// Voxels are 32-bit floats, which tell whole numbers apart up to 2^24.
/// @throws InputError  the label lies beyond
void check_label(std::optional<int> label);

/// True for voxels of the label; without a label, for all that are not 0.
inline bool is_labelled(float value, std::optional<int> label) {
  return label ? value == static_cast<float>(*label) : value != 0;
}

/// The surface halfway between the voxels of a label and their neighbours: marching cubes of
/// the binary mask at 0.5, its vertices in the middle of the grid's edges, moved to RAS mm by the
/// volume's affine. Not smoothed: it has the mask's staircases, which lie up to half
/// a voxel (0.17 on average on a ball) from the object's own surface.
///
/// Closed (a label at the volume's border is capped half a voxel outside), 2-manifold and
/// free of self-intersections for every mask, and outward for every affine, mirrored
/// ones too. Voxels that touch only diagonally are not joined. Several parts and cavities are kept.
///
/// O(voxels), two slices in memory at a time.
///
/// @throws InputError  no voxel has the label, or check_label() refuses it
Triangles surface_of_label_map(const volume::Volume& labels, std::optional<int> label = {});

/// The surface between the voxels above a level and the others, its vertices where the values,
/// linear along the grid's edges, reach it, but at least a twentieth of an edge from its ends.
/// Closed, 2-manifold and outward as above, empty if no voxel is above; it may intersect itself
/// where several of its sheets lie within one cell. Caps at the volume's border lie half a voxel
/// outside. The values are finite.
Triangles surface_of_level(const volume::Volume& values, double level);

}  // namespace surf::mesh
