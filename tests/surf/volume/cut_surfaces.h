// Grids and bodies that cut their cells, for the tests of cut cells and what is built on them.
#pragma once

#include <Eigen/Geometry>

#include "libsurf/volume/tiled_field.h"
#include "tests/surf/fixtures.h"

namespace surf::volume {

/// About the cube [-1.5, 1.5]^3 with `n` cells along it, turned, stretched and sheared by little.
inline Grid oblique_grid(int n, bool is_mirrored = false) {
  Eigen::Matrix3d axes;
  axes << 1, 0.1, 0, 0, 1.2, 0.05, 0, 0, 0.9;
  axes = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()) * axes * (4.0 / n);
  if (is_mirrored) axes.col(0) *= -1;
  Grid grid{{n + 1, n + 1, n + 1}, Eigen::Affine3d::Identity()};
  grid.index_to_world.linear() = axes;
  grid.index_to_world.translation() = -axes * Eigen::Vector3d::Constant(0.5 * n);
  return grid;
}

/// The box [0, a] x [0, b] x [0, c], outward, moved by a rigid motion.
inline test::Arrays<3> box_surface(const Eigen::Vector3d& sides, const Eigen::Affine3d& motion) {
  test::Arrays<3> out;
  out.X.resize(8, 3);
  for (int n = 0; n < 8; ++n)
    out.X.row(n) =
        motion * Eigen::Vector3d((n & 1) * sides[0], (n >> 1 & 1) * sides[1], (n >> 2) * sides[2]);
  out.T.resize(12, 3);
  out.T << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6,
      1, 3, 5, 3, 7, 5;
  return out;
}

}  // namespace surf::volume
