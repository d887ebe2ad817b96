#include "libsurf/mesh/detail/patch_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

constexpr double kCosTurn = 0.5;  // triangles turn by no more than 60 degrees

}  // namespace

/// The plane's point if inside, else on the closest side.
double squared_distance(const Vector3d& point, const Corners& t) {
  const Vector3d normal = area_normal(t[0], t[1], t[2]);
  bool is_inside = normal.squaredNorm() > 0;
  double on_sides = std::numeric_limits<double>::max();
  for (int k = 0; k < 3; ++k) {
    const Vector3d side = t[(k + 1) % 3] - t[k], offset = point - t[k];
    if (normal.dot(side.cross(offset)) >= 0) continue;
    is_inside = false;
    const double at = std::clamp(offset.dot(side) / side.squaredNorm(), 0.0, 1.0);
    on_sides = std::min(on_sides, (offset - at * side).squaredNorm());
  }
  if (!is_inside) return on_sides;
  const double height = normal.dot(point - t[0]);
  return height * height / normal.squaredNorm();
}

std::size_t closest(const Vector3d& point, const std::vector<Corners>& patch) {
  std::size_t triangle = 0;
  double least = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < patch.size(); ++k) {
    const double squared = squared_distance(point, patch[k]);
    if (squared < least) least = squared, triangle = k;
  }
  return triangle;
}

bool is_near(const Vector3d& point, const std::vector<Corners>& patch, double distance) {
  return std::any_of(patch.begin(), patch.end(), [&](const Corners& triangle) {
    return squared_distance(point, triangle) <= distance * distance;
  });
}

bool is_star_near(const std::vector<Corners>& star, const std::vector<Corners>& patch,
                  double distance) {
  if (!is_near(star.front()[0], patch, distance)) return false;
  return std::all_of(star.begin(), star.end(), [&](const Corners& t) {
    return is_near(0.5 * (t[0] + t[1]), patch, distance);
  });
}

double sharpest(const std::vector<Corners>& patch) {
  double cosine = -1;
  for (const Corners& t : patch)
    cosine = std::max(cosine, angle_cosines(t[0], t[1], t[2]).sharpest);
  return cosine;
}

bool turns_too_far(const Vector3d& before, const Vector3d& now) {
  return !(before.dot(now) >= kCosTurn * std::sqrt(before.squaredNorm() * now.squaredNorm()));
}

double longest_spoke(const std::vector<Corners>& star) {
  double longest = 0;
  for (const Corners& t : star) longest = std::max(longest, (t[1] - t[0]).norm());
  return longest;
}

}  // namespace surf::mesh
