// Mass and stiffness of the trilinear functions on a part of a cell. Private to volume/*.cpp.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "libsurf/volume/cut_cells.h"

namespace surf::volume {

/// Corner (x, y, z) of the cell, each 0 or 1, is number x + 2 y + 4 z.
using CellMatrix = Eigen::Matrix<double, 8, 8>;

/// How a cell lies in the world.
struct CellMetric {
  double volume;           ///< [mm^3]
  Eigen::Matrix3d metric;  ///< |grad u|^2 = d^T metric d for derivatives d along the axes [1/mm^2]

  explicit CellMetric(const Eigen::Matrix3d& index_to_world);
};

/// int phi_a phi_b over the part of the unit cell with these moments.
CellMatrix cell_mass(const Moments& moments);

/// mass * int phi_a phi_b + stiffness * int grad phi_a . grad phi_b [mm^3 for mass = 1].
CellMatrix cell_matrix(const Moments& moments, const CellMetric& metric, double mass,
                       double stiffness);

}  // namespace surf::volume
