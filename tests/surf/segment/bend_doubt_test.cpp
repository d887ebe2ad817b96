#include "libsurf/segment/detail/bend_doubt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "libsurf/mesh/primitives.h"

namespace surf::segment {
namespace {

// Smoothing of the curvature leaves balls alone: what is left is what triangles make of them.
TEST(BendDoubts, ABallHasNone) {
  for (const double radius : {5.0, 20.0}) {
    const Triangles ball = mesh::ball({1, 2, 3}, radius, 1);
    const fem::Geometry<3> shape(ball.points, ball.elements);
    EXPECT_LT(bend_doubts<3>(shape, 0.5, 6).maxCoeff(), 1e-3 * radius);
  }
}

/// A cube of 2 h^3 with a vertex every mm.
Triangles cube(int h) {
  Triangles out;
  std::vector<Vector<3>> points;
  std::vector<Eigen::RowVector3i> elements;
  const auto add = [&](const Vector<3>& x) {
    const auto found = std::find(points.begin(), points.end(), x);
    if (found != points.end()) return int(found - points.begin());
    points.push_back(x);
    return int(points.size()) - 1;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int u = -h; u < h; ++u)
        for (int v = -h; v < h; ++v) {
          const auto at = [&](int du, int dv) {
            Vector<3> x;
            x[axis] = side * h;
            x[(axis + 1) % 3] = u + du;
            x[(axis + 2) % 3] = v + dv;
            return add(x);
          };
          const int a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          elements.emplace_back(a, side > 0 ? b : c, side > 0 ? c : b);
          elements.emplace_back(a, side > 0 ? c : d, side > 0 ? d : c);
        }
  out.points.resize(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) out.points.row(Eigen::Index(i)) = points[i];
  out.elements.resize(Eigen::Index(elements.size()), 3);
  for (std::size_t t = 0; t < elements.size(); ++t) out.elements.row(Eigen::Index(t)) = elements[t];
  return out;
}

TEST(BendDoubts, ACubeHasThemAtItsEdgesAlone) {
  const int h = 10;
  const Triangles body = cube(h);
  const fem::Geometry<3> shape(body.points, body.elements);
  const Eigen::VectorXd doubts = bend_doubts<3>(shape, 0.5, 4);
  for (Eigen::Index i = 0; i < doubts.size(); ++i) {
    Vector<3> from_face = h - body.points.row(i).transpose().array().abs();
    std::sort(from_face.begin(), from_face.end());
    const double from_edge = from_face[1];
    if (from_edge <= 1) {
      EXPECT_GT(doubts[i], 0.05) << body.points.row(i);
    } else if (from_edge >= 8) {
      EXPECT_LT(doubts[i], 0.01) << body.points.row(i);
    }
  }
  // Lengths are lengths: twice as large all over, twice the deviations.
  const fem::Geometry<3> twice(2 * body.points, body.elements);
  EXPECT_LT((bend_doubts<3>(twice, 1, 8) - 2 * doubts).cwiseAbs().maxCoeff(), 1e-9);
  // And as the square of the length below which it is taken for smooth.
  EXPECT_LT((bend_doubts<3>(shape, 0.5, 8) - 4 * doubts).cwiseAbs().maxCoeff(), 1e-9);
}

// Where a volume ends the cube goes on: the edges that its face makes are none of the object.
TEST(BendDoubts, WhatABorderCutsOffHasNone) {
  const int h = 6;
  const Triangles body = cube(h);
  Points<3> normals(1, 3);
  normals << 0, 0, 1;
  std::vector<std::uint8_t> planes;
  for (const auto x : body.points.rowwise()) planes.push_back(x[2] == h ? 1 : 0);
  const fem::Geometry<3> whole(body.points, body.elements),
      cut(body.points, body.elements, {normals, planes});
  const Eigen::VectorXd of_whole = bend_doubts<3>(whole, 0.5, 4),
                        of_cut = bend_doubts<3>(cut, 0.5, 4);
  for (Eigen::Index i = 0; i < of_cut.size(); ++i) {
    if (body.points(i, 2) == h) {
      EXPECT_EQ(of_cut[i], 0);
    } else if (body.points(i, 2) == h - 1 && std::abs(body.points(i, 0)) < 2 &&
               body.points(i, 1) == h) {
      EXPECT_LT(of_cut[i], 0.1 * of_whole[i]);
    }
  }
}

}  // namespace
}  // namespace surf::segment
