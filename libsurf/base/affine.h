// The affine maps that files give for where their values lie.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "libsurf/base/error.h"

namespace surf {

/// The matrix of a file as an affine map.
/// @param path  of the file;  @param cell  "voxel" or "pixel"
/// @throws InputError  non-finite, not affine, a spacing of zero, singular
template <int Dim>
Eigen::Transform<double, Dim, Eigen::Affine> checked_affine(
    const Eigen::Matrix<double, Dim + 1, Dim + 1>& matrix, const std::string& path,
    const char* cell) {
  if (!matrix.allFinite())
    throw InputError(fmt::format("{}: the {}-to-world matrix has a NaN or Inf", path, cell));
  if (matrix.row(Dim) != Eigen::Matrix<double, 1, Dim + 1>::Unit(Dim))
    throw InputError(fmt::format("{}: the {}-to-world matrix is not affine", path, cell));
  const Eigen::Matrix<double, Dim, Dim> linear = matrix.template topLeftCorner<Dim, Dim>();
  const Eigen::Matrix<double, 1, Dim> spacing = linear.colwise().norm();
  if (spacing.minCoeff() <= 0) {
    std::string sizes;
    for (const double size : spacing)
      sizes += fmt::format("{}{}", sizes.empty() ? "" : " x ", size);
    throw InputError(fmt::format("{}: zero {} spacing ({} mm)", path, cell, sizes));
  }
  // Content of the cell relative to that of a box with the same spacings.
  if (!(std::abs(linear.determinant()) / spacing.prod() > 1e-6))
    throw InputError(fmt::format("{}: the {}-to-world matrix is singular", path, cell));
  return Eigen::Transform<double, Dim, Eigen::Affine>(matrix);
}

}  // namespace surf
