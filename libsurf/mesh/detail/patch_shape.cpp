#include "libsurf/mesh/detail/patch_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

constexpr double kCosTurn = 0.5;  // triangles turn by no more than 60 degrees

}  // namespace

NearPatch::NearPatch(const std::vector<Corners>& patch) {
  triangles_.reserve(patch.size());
  for (const Corners& t : patch) {
    const Vector3d centre = (t[0] + t[1] + t[2]) / 3;
    const double squared = std::max({(t[0] - centre).squaredNorm(), (t[1] - centre).squaredNorm(),
                                     (t[2] - centre).squaredNorm()});
    triangles_.push_back({&t, area_normal(t[0], t[1], t[2]), centre, std::sqrt(squared)});
  }
}

/// The plane's point if inside, else on the closest side.
double NearPatch::squared_distance(const Vector3d& point, const Triangle& triangle) {
  const Corners& t = *triangle.corners;
  const Vector3d& normal = triangle.normal;
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

/// By more than rounding.
bool NearPatch::is_beyond(const Vector3d& point, const Triangle& triangle, double distance) {
  constexpr double kMargin = 1 + 1e-9;
  const double reach = kMargin * (triangle.radius + distance);
  return (point - triangle.centre).squaredNorm() > reach * reach;
}

std::size_t NearPatch::closest(const Vector3d& point) const {
  std::size_t triangle = 0;
  double least = std::numeric_limits<double>::max(), distance = least;
  for (std::size_t k = 0; k < triangles_.size(); ++k) {
    if (is_beyond(point, triangles_[k], distance)) continue;
    const double squared = squared_distance(point, triangles_[k]);
    if (squared < least) least = squared, distance = std::sqrt(squared), triangle = k;
  }
  return triangle;
}

bool NearPatch::is_near(const Vector3d& point, double distance) const {
  return std::any_of(triangles_.begin(), triangles_.end(), [&](const Triangle& triangle) {
    return !is_beyond(point, triangle, distance) &&
           squared_distance(point, triangle) <= distance * distance;
  });
}

std::vector<std::size_t> closest_of(const std::vector<Corners>& patch,
                                    const std::vector<Vector3d>& points) {
  const NearPatch near(patch);
  std::vector<std::size_t> out;
  for (const Vector3d& point : points) out.push_back(near.closest(point));
  return out;
}

bool is_star_near(const std::vector<Corners>& star, const NearPatch& patch, double distance) {
  if (!patch.is_near(star.front()[0], distance)) return false;
  return std::all_of(star.begin(), star.end(), [&](const Corners& t) {
    return patch.is_near(0.5 * (t[0] + t[1]), distance);
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
