// Arrays shared by every folder: plain contiguous points and elements, so that
// numerics need to know no mesh library.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <type_traits>

namespace surf {

/// A point or vector in R^Dim, world frame: right-handed RAS+ millimetres.
template <int Dim>
using Vector = Eigen::Matrix<double, Dim, 1>;

/// Points or nodal vectors, one per row: (n, Dim), row-major.
template <int Dim>
using Points = Eigen::Matrix<double, Eigen::Dynamic, Dim, Eigen::RowMajor>;

/// Elements, one per row: (m, Dim) vertex indices. Segments for Dim = 2,
/// triangles for Dim = 3, oriented so that normals point outward.
template <int Dim>
using Elements = Eigen::Matrix<int, Eigen::Dynamic, Dim, Eigen::RowMajor>;

/// A triangle surface as plain arrays: what files hold and what checks look at.
struct Triangles {
  Points<3> points;      ///< (n, 3) [mm, RAS]
  Elements<3> elements;  ///< (m, 3), counter-clockwise seen from outside
};

/// Closed polygons in the plane as plain arrays: each vertex ends one element and starts one. The
/// domain is on the left, so the outward normal of element (a, b) is (dy, -dx) / length.
struct Segments {
  Points<2> points;      ///< (n, 2) [mm]
  Elements<2> elements;  ///< (m, 2), start and end
};

/// A shape as plain arrays: Segments or Triangles.
template <int Dim>
using Simplices = std::conditional_t<Dim == 2, Segments, Triangles>;

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

}  // namespace surf
