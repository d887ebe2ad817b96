// Trilinear elements: the functions on a cell of a grid that are linear along each axis, restricted
// to a part of the cell.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

namespace surf::fem {

/// Integrals of x^a y^b z^c, 0 <= a, b, c <= 2, over a part of the unit cell, at 9 c + 3 b + a.
/// Products of two trilinear functions and of their derivatives are sums of these.
using Moments = std::array<double, 27>;

/// Those of the whole cell.
const Moments& full_moments();

/// The eight functions at a point of the unit cell. Corner (x, y, z), each 0 or 1, is number
/// x + 2 y + 4 z.
std::array<double, 8> trilinear_values(const Eigen::Vector3d& x);
/// Their derivatives along the axes.
std::array<Eigen::Vector3d, 8> trilinear_slopes(const Eigen::Vector3d& x);

/// Rows and columns by the number of the corner.
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

}  // namespace surf::fem
