#include "libsurf/volume/orientation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace surf::volume {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

/// The world axis of each index axis: the permutation whose product of cosines is largest.
std::array<int, 3> nearest_axes(const Eigen::Matrix3d& cosines) {
  std::array<int, 3> axes = {0, 1, 2}, best = axes;
  double largest = -1;
  do {
    const double product =
        std::abs(cosines(axes[0], 0) * cosines(axes[1], 1) * cosines(axes[2], 2));
    if (product > largest) {
      largest = product;
      best = axes;
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return best;
}

/// The angle whose cosine is |a . b|, exact for small angles too.
double acute_angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * kDegrees;
}

}  // namespace

Orientation orientation_of(const Eigen::Affine3d& index_to_world) {
  constexpr std::array<const char*, 3> kPositive = {"R", "A", "S"}, kNegative = {"L", "P", "I"};
  const Eigen::Matrix3d cosines = index_to_world.linear().colwise().normalized();
  const std::array<int, 3> axes = nearest_axes(cosines);
  Orientation result;
  for (int n = 0; n < 3; ++n) {
    const int axis = axes[n];
    result.code += cosines(axis, n) > 0 ? kPositive[axis] : kNegative[axis];
    result.oblique_deg =
        std::max(result.oblique_deg, acute_angle_deg(cosines.col(n), Eigen::Vector3d::Unit(axis)));
    result.shear_deg =
        std::max(result.shear_deg, 90 - acute_angle_deg(cosines.col(n), cosines.col((n + 1) % 3)));
  }
  result.is_mirrored = index_to_world.linear().determinant() < 0;
  return result;
}

AxisOrder ras_order(const Eigen::Affine3d& index_to_world) {
  const Eigen::Matrix3d cosines = index_to_world.linear().colwise().normalized();
  const std::array<int, 3> world_axes = nearest_axes(cosines);
  AxisOrder order;
  for (int n = 0; n < 3; ++n) {
    order.axes[world_axes[n]] = n;
    order.are_reversed[world_axes[n]] = cosines(world_axes[n], n) < 0;
  }
  return order;
}

std::array<Eigen::Vector3d, 2> bounds_ras_mm(const Eigen::Affine3d& index_to_world,
                                             const std::array<int, 3>& size) {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d upper = -lower;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis) index[axis] = (corner >> axis & 1) * (size[axis] - 1);
    const Eigen::Vector3d point = index_to_world * index;
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  return {lower, upper};
}

}  // namespace surf::volume
