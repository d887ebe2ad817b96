// Triangle surfaces with known answers, for the tests of checks, measures and files.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "libsurf/base/arrays.h"
#include "libsurf/base/types.h"
#include "tests/surf/torus.h"

namespace surf::test {

inline Triangles to_triangles(const std::vector<Vector<3>>& points,
                              const std::vector<std::array<int, 3>>& elements) {
  return {points_of<3>(points), elements_of(elements)};
}

inline Triangles tetrahedron() {
  return to_triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                      {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
}

/// [0, 1]^3, 12 triangles.
inline Triangles cube() {
  std::vector<Vector<3>> points;
  for (int c = 0; c < 8; ++c) points.emplace_back(c & 1, c >> 1 & 1, c >> 2 & 1);
  return to_triangles(points, {{0, 2, 3},
                               {0, 3, 1},
                               {4, 5, 7},
                               {4, 7, 6},
                               {0, 1, 5},
                               {0, 5, 4},
                               {2, 6, 7},
                               {2, 7, 3},
                               {0, 4, 6},
                               {0, 6, 2},
                               {1, 3, 7},
                               {1, 7, 5}});
}

/// Each triangle in four, `levels` times, the new vertices moved by `place`.
template <class Place>
Triangles subdivided(const Triangles& coarse, int levels, Place place) {
  std::vector<Vector<3>> points;
  std::vector<std::array<int, 3>> elements;
  for (const auto point : coarse.points.rowwise()) points.push_back(place(Vector<3>(point)));
  for (const auto e : coarse.elements.rowwise()) elements.push_back({e[0], e[1], e[2]});
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (is_new) points.push_back(place((points[a] + points[b]) / 2));
      return at->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : elements) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& e : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
        finer.push_back(e);
    }
    elements = finer;
  }
  return to_triangles(points, elements);
}

/// Octahedron refined: 8 * 4^levels triangles with their vertices on the sphere.
inline Triangles sphere(const Vector<3>& center, double radius, int levels) {
  const Triangles octahedron = to_triangles(
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
  Triangles result =
      subdivided(octahedron, levels, [](const Vector<3>& p) { return p.normalized(); });
  result.points = (result.points * radius).rowwise() + center.transpose();
  return result;
}

/// Torus round the z axis, n times m quadrilaterals.
inline Triangles torus(double big_radius, double small_radius, int n, int m) {
  return torus_triangles(big_radius, small_radius, n, m);
}

/// The quadrilaterals of a torus, one direction glued with a flip: closed, each edge in two
/// triangles, and not orientable.
inline Triangles klein_bottle(int n, int m) {
  Triangles surface = torus(3, 1, n, m);
  for (int a = n - 1, b = 0; b < m; ++b) {
    const auto glued = [&](int at) { return (m - at % m) % m; };
    const int p = a * m + b, q = a * m + (b + 1) % m, r = glued(b), s = glued(b + 1);
    surface.elements.row(2 * (a * m + b)) << p, r, s;
    surface.elements.row(2 * (a * m + b) + 1) << p, s, q;
  }
  return surface;
}

inline Triangles flipped(Triangles surface) {
  surface.elements.col(1).swap(surface.elements.col(2));
  return surface;
}

inline Triangles moved(Triangles surface, const Eigen::Affine3d& affine) {
  surface.points =
      ((surface.points * affine.linear().transpose()).rowwise() + affine.translation().transpose())
          .eval();
  return surface;
}

inline Triangles moved(const Triangles& surface, const Vector<3>& by) {
  return moved(surface, Eigen::Affine3d(Eigen::Translation3d(by)));
}

/// Both, side by side in one set of arrays.
inline Triangles joined(const Triangles& a, const Triangles& b) {
  Triangles result;
  result.points.resize(a.points.rows() + b.points.rows(), 3);
  result.points << a.points, b.points;
  result.elements.resize(a.elements.rows() + b.elements.rows(), 3);
  result.elements << a.elements, b.elements.array() + static_cast<int>(a.points.rows());
  return result;
}

/// Vertices with equal coordinates become one.
inline Triangles welded(const Triangles& surface) {
  std::map<std::array<double, 3>, int> numbers;
  std::vector<Vector<3>> points;
  Triangles result = surface;
  for (Eigen::Index at = 0; at < surface.elements.size(); ++at) {
    const Vector<3> point = surface.points.row(surface.elements.data()[at]);
    const auto [number, is_new] =
        numbers.try_emplace({point[0], point[1], point[2]}, static_cast<int>(points.size()));
    if (is_new) points.push_back(point);
    result.elements.data()[at] = number->second;
  }
  result.points = to_triangles(points, {}).points;
  return result;
}

/// Without triangle `row`.
inline Triangles without_triangle(const Triangles& surface, Eigen::Index row) {
  Triangles result = surface;
  const Eigen::Index n = surface.elements.rows() - 1;
  result.elements.row(row) = surface.elements.row(n);
  result.elements.conservativeResize(n, 3);
  return result;
}

}  // namespace surf::test
