#include "libsurf/mesh/primitives.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

using Eigen::Vector3d;

constexpr double kMaxTriangles = 2e7;

void check_length(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw UsageError(fmt::format("{}: expected a positive length, got {} mm", name, value));
}

void check_count(double n_triangles, double edge_length) {
  if (!(n_triangles <= kMaxTriangles))
    throw UsageError(fmt::format(
        "edge length {} mm would give {:.2g} triangles, the limit is {:.0g}; take longer edges",
        edge_length, n_triangles, kMaxTriangles));
}

/// Points that are found again by an integer key.
class PointSet {
 public:
  using Key = std::array<int, 6>;

  template <class Position>
  int index(const Key& key, const Position& position) {
    const auto [at, is_new] = indices_.try_emplace(key, static_cast<int>(points_.size()));
    if (is_new) points_.push_back(position());
    return at->second;
  }

  Points<3> points() const { return points_of<3>(points_); }

 private:
  std::map<Key, int> indices_;
  std::vector<Vector3d> points_;
};

std::array<Vector3d, 12> icosahedron_points() {
  constexpr double kGolden = std::numbers::phi;
  std::array<Vector3d, 12> points;
  int n = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const double one : {-1.0, 1.0})
      for (const double golden : {-kGolden, kGolden}) {
        Vector3d& point = points[n++];
        point[axis] = 0;
        point[(axis + 1) % 3] = one;
        point[(axis + 2) % 3] = golden;
      }
  return points;
}

/// Three points at distance 2 of each other, counter-clockwise from outside.
std::vector<std::array<int, 3>> icosahedron_triangles(const std::array<Vector3d, 12>& points) {
  const auto is_edge = [&](int i, int j) {
    return std::abs((points[i] - points[j]).squaredNorm() - 4) < 1e-6;
  };
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i < 12; ++i)
    for (int j = i + 1; j < 12; ++j)
      for (int k = j + 1; k < 12; ++k) {
        if (!is_edge(i, j) || !is_edge(j, k) || !is_edge(k, i)) continue;
        const bool is_outward = points[i].dot(points[j].cross(points[k])) > 0;
        triangles.push_back(is_outward ? std::array{i, j, k} : std::array{i, k, j});
      }
  return triangles;
}

/// Unit vector that divides the arc in equal parts along the corners' great circles: spherical
/// barycentric weights sin(w t), which keep edges more even than flat ones (ratio of the longest to
/// the shortest 1.18 instead of 1.43 at k = 16).
Vector3d on_sphere(const std::array<Vector3d, 3>& corners, const std::array<int, 3>& weight,
                   int k) {
  const double angle = std::acos(corners[0].dot(corners[1]));
  Vector3d point = Vector3d::Zero();
  for (int corner = 0; corner < 3; ++corner)
    point += std::sin(angle * weight[corner] / k) * corners[corner];
  return point.normalized();
}

/// Names the point by its weights at corners with a weight, in the order of the corners' indices,
/// so that both triangles of an edge give it the same name.
PointSet::Key weights_key(const std::array<int, 3>& corners, const std::array<int, 3>& weights) {
  std::array<std::array<int, 2>, 3> pairs;
  for (int corner = 0; corner < 3; ++corner)
    pairs[corner] =
        weights[corner] == 0 ? std::array{-1, 0} : std::array{corners[corner], weights[corner]};
  std::sort(pairs.begin(), pairs.end());
  return {pairs[0][0], pairs[0][1], pairs[1][0], pairs[1][1], pairs[2][0], pairs[2][1]};
}

/// Unit sphere with edges of the icosahedron cut into k.
Triangles unit_sphere(int k) {
  const auto base = icosahedron_points();
  PointSet points;
  std::vector<std::array<int, 3>> triangles;
  for (const auto& face : icosahedron_triangles(base)) {
    const std::array<Vector3d, 3> corners = {base[face[0]].normalized(), base[face[1]].normalized(),
                                             base[face[2]].normalized()};
    const auto vertex = [&](int i, int j) {
      const std::array<int, 3> weights = {k - i - j, i, j};
      return points.index(weights_key(face, weights),
                          [&] { return on_sphere(corners, weights, k); });
    };
    for (int i = 0; i < k; ++i)
      for (int j = 0; i + j < k; ++j) {
        triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)});
        if (i + j + 1 < k)
          triangles.push_back({vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
      }
  }
  return {points.points(), elements_of(triangles)};
}

/// Parts of the icosahedron's edges for a sphere of the given radius.
int n_parts(double radius, double edge_length) {
  // Mean edge on the unit sphere: 1.0515 / k at k = 1, growing to 1.2083 / k (measured to k = 64).
  constexpr double kMeanEdge = 1.2083;
  const double k = std::max(1.0, std::ceil(kMeanEdge * radius / edge_length));
  check_count(20 * k * k, edge_length);
  return static_cast<int>(k);
}

}  // namespace

Triangles ball(const Vector3d& center, double radius, double edge_length) {
  check_length("radius", radius);
  check_length("edge length", edge_length);
  Triangles result = unit_sphere(n_parts(radius, edge_length));
  result.points = (radius * result.points).rowwise() + center.transpose();
  return result;
}

Triangles ellipsoid(const Vector3d& center, const Eigen::Matrix3d& axes, double edge_length) {
  check_length("edge length", edge_length);
  const Eigen::Vector3d stretches = axes.jacobiSvd().singularValues();
  if (!axes.allFinite() || !(stretches[2] > 1e-9 * stretches[0]))
    throw UsageError("ellipsoid: the semi-axes do not span the space");
  Triangles result = unit_sphere(n_parts(stretches[0], edge_length));
  result.points = ((result.points * axes.transpose()).rowwise() + center.transpose()).eval();
  if (axes.determinant() < 0) result.elements.col(1).swap(result.elements.col(2));
  return result;
}

Triangles box(const Vector3d& lower, const Vector3d& upper, double edge_length) {
  check_length("edge length", edge_length);
  std::array<int, 3> n;
  for (int axis = 0; axis < 3; ++axis) {
    check_length("side of the box", upper[axis] - lower[axis]);
    // Not one part more for a side that is a multiple of the length but for rounding.
    const double parts = std::ceil((upper[axis] - lower[axis]) / edge_length * (1 - 1e-12));
    check_count(4 * parts, edge_length);  // of a row round it; more than that an int may not hold
    n[axis] = std::max(1, static_cast<int>(parts));
  }
  check_count(4.0 * (1.0 * n[0] * n[1] + 1.0 * n[1] * n[2] + 1.0 * n[2] * n[0]), edge_length);

  PointSet points;
  std::vector<std::array<int, 3>> triangles;
  const auto vertex = [&](const std::array<int, 3>& at) {
    return points.index({at[0], at[1], at[2], 0, 0, 0}, [&] {
      Vector3d point;
      for (int axis = 0; axis < 3; ++axis) {
        const double t = static_cast<double>(at[axis]) / n[axis];
        point[axis] = (1 - t) * lower[axis] + t * upper[axis];
      }
      return point;
    });
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const bool is_upper : {false, true}) {
      // (u, v, axis) is right-handed, so u x v points outward on the upper side.
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int i = 0; i < n[u]; ++i)
        for (int j = 0; j < n[v]; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> at;
            at[axis] = is_upper ? n[axis] : 0;
            at[u] = i + di;
            at[v] = j + dj;
            return vertex(at);
          };
          std::array<int, 4> square = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
          if (!is_upper) std::swap(square[1], square[3]);
          // The diagonals alternate: no vertex has all of its squares cut through it.
          if ((i + j) % 2 == 0) {
            triangles.push_back({square[0], square[1], square[2]});
            triangles.push_back({square[0], square[2], square[3]});
          } else {
            triangles.push_back({square[0], square[1], square[3]});
            triangles.push_back({square[1], square[2], square[3]});
          }
        }
    }
  return {points.points(), elements_of(triangles)};
}

Triangles joined(const std::vector<Triangles>& parts) { return all_of(parts); }

Triangles flipped(Triangles surface) {
  surface.elements.col(1).swap(surface.elements.col(2));
  return surface;
}

}  // namespace surf::mesh
