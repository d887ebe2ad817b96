// Quadrature rules on segments and triangles in barycentric coordinates.
#pragma once

#include <Eigen/Core>

namespace surf::fem {

/// A rule on the reference simplex with Dim vertices: a segment (2) or a triangle (3).
template <int Dim>
struct Quadrature {
  Eigen::Matrix<double, Eigen::Dynamic, Dim, Eigen::RowMajor> points;  ///< (q, Dim) barycentric
  Eigen::VectorXd weights;  ///< (q), positive, their sum is 1
  Eigen::Index size() const { return weights.size(); }
};

/// The rule that is exact for polynomials of degree <= order; all weights positive.
/// Segments: Gauss-Legendre. Triangles: 1, 3, 6, 6, 7 points (Strang and Fix 1973; Dunavant
/// 1985, degrees 4 and 5; the 6-point rule of degree 4 serves degree 3, whose own rule has a
/// negative weight).
/// @param order  1 to 5
/// @throws std::out_of_range
template <int Dim>
const Quadrature<Dim>& quadrature(int order);

}  // namespace surf::fem
