// How a volume's axes lie in the world, in words.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

namespace surf::volume {

struct Orientation {
  /// Where the first, second and third index run to, as nearly as axes can: "RAS", "LPI", ...
  std::string code;
  double oblique_deg = 0;    ///< largest angle between an index axis and its world axis
  double shear_deg = 0;      ///< largest deviation from 90 degrees between two index axes
  bool is_mirrored = false;  ///< negative determinant
};

/// @param index_to_world  voxel centre to RAS mm, invertible
Orientation orientation_of(const Eigen::Affine3d& index_to_world);

/// Which index axis takes which place, and which of them are turned round.
struct AxisOrder {
  std::array<int, 3> axes = {0, 1, 2};
  std::array<bool, 3> are_reversed = {false, false, false};
};

/// The index axes that run most nearly along R, A and S, reversed where they run to L, P or I.
/// @param index_to_world  voxel centre to RAS mm, invertible
AxisOrder ras_order(const Eigen::Affine3d& index_to_world);

/// Smallest and largest world coordinates of the voxel centres [mm, RAS].
std::array<Eigen::Vector3d, 2> bounds_ras_mm(const Eigen::Affine3d& index_to_world,
                                             const std::array<int, 3>& size);

}  // namespace surf::volume
