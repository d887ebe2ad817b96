// Test volumes whose surface is known exactly: a smooth step across the boundary of a
// simple body.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "libsurf/volume/volume.h"

namespace surf::volume {

/// The bodies, in units u where the volume's shortest side is [-1, 1]; all lie in the unit ball.
enum class PhantomKind {
  kBall,      ///< radius 0.6
  kTwoBalls,  ///< radius 0.4 about (+-0.4, 0, 0): they touch at the origin
  kBox,       ///< half sides 0.6, 0.4, 0.3
  kTorus,     ///< about the z axis: radius 0.5 of the centre line, 0.2 of the tube
  kVessel,    ///< a tree of capsules: trunk along z, two main branches, four ends, a side branch
  kSeparateBalls,  ///< radius 0.3 about (+-0.5, 0, 0)
  kShell,          ///< radius 0.6 with a cavity of radius 0.3
  kTree,  ///< a trunk along z and five branches, capsules thicker than the vessel's; genus 0
  kRods   ///< the ball, bored through by 40 straight rods that are background; genus 40
};

/// All bodies by their names: "ball", "two-balls", ...
const std::map<std::string, PhantomKind>& phantom_kinds();

/// A ball swept along a segment, in units.
struct Capsule {
  Eigen::Vector3d start, end;
  double radius;
};

/// The vessels of kTree: the trunk, then the branches; each branch begins on the trunk's axis.
const std::array<Capsule, 6>& tree_capsules();

/// The rods of kRods: chords of the ball of radius 0.66, of radius 0.022, whose axes
/// keep 0.07 from each other and pass the centre in up to 0.45.
const std::array<Capsule, 40>& rod_capsules();

struct PhantomOptions {
  PhantomKind kind = PhantomKind::kBall;
  std::array<int, 3> size = {128, 128, 128};
  /// Per axis [mm]; by default 2 / (shortest size - 1), so that one unit is 1 mm.
  std::optional<Eigen::Vector3d> spacing_mm;
  /// Columns: where the indices run to in RAS. Any invertible matrix; the body keeps its place
  /// and axes in the world, only the grid that samples it turns.
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  /// Voxel (0, 0, 0) in RAS mm; by default the volume's centre is the world's origin. The
  /// body's centre is the volume's centre.
  std::optional<Eigen::Vector3d> origin_ras_mm;
  /// Half the width w of the edge [mm]: the value runs from 1 to 0 for |d| <= w. By default 0.05
  /// units.
  std::optional<double> edge_width_mm;
  /// Standard deviation of the Gaussian noise, where the body's contrast is 1.
  double noise = 0;
  std::uint64_t random_seed = 0;

  /// Empty if valid, else field, value and constraint.
  std::string error() const;
  Eigen::Affine3d index_to_world() const;
  /// Length of one unit [mm]: half the least distance of opposite sides of the volume.
  double unit_mm() const;
  /// Centre of the volume, and of the body [mm, RAS].
  Eigen::Vector3d center_ras_mm() const;
};

/// Signed distance to the surface of a body at u, negative inside, all in units. Exact, except in
/// the vessel and the tree, where capsules overlap: there the depth is a lower bound; and in the
/// rods outside the body, where it is a lower bound of the distance near the rods' mouths.
double phantom_distance(PhantomKind kind, const Eigen::Vector3d& point);

/// The same for the body of `options` at a point of the world [mm].
double phantom_distance_mm(const PhantomOptions& options, const Eigen::Vector3d& point_ras_mm);

/// I = (1 + t + sin(pi t) / pi) / 2 with t = clip(-d / w, -1, 1), d the signed distance and w
/// the edge width: twice continuously differentiable, 1 inside, 0 outside, 1/2 on the surface.
/// The noise of a voxel depends on its index and the seed only.
/// @throws UsageError  options.error() is not empty
Volume make_phantom(const PhantomOptions& options);

}  // namespace surf::volume
