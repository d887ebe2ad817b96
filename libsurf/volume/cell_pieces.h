// Triangles cut at the planes of a grid's cells: integrals over the part of a surface in each cell.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace surf::volume {

/// A corner of a piece of a triangle: where it lies in the grid's indices, and in the triangle.
struct PieceCorner {
  Eigen::Vector3d index, barycentric;
};

/// The part of a triangle in a cell, or in a slab of cells: convex, at most 3 + 6 corners.
struct Piece {
  std::array<PieceCorner, 9> corners;
  int n = 0;

  void add(const PieceCorner& corner) {
    if (n < int(corners.size())) corners[n++] = corner;
  }
  std::array<double, 2> range(int axis) const {
    double low = corners[0].index[axis], high = low;
    for (int m = 1; m < n; ++m) {
      low = std::min(low, corners[m].index[axis]);
      high = std::max(high, corners[m].index[axis]);
    }
    return {low, high};
  }
};

inline Piece whole_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  Piece piece;
  piece.add({a, Eigen::Vector3d::UnitX()});
  piece.add({b, Eigen::Vector3d::UnitY()});
  piece.add({c, Eigen::Vector3d::UnitZ()});
  return piece;
}

/// The parts with index[axis] <= at and >= at.
void split(const Piece& piece, int axis, double at, Piece& below, Piece& above);

/// First and last cell along an axis that a range of indices meets; one in the plane between two
/// cells belongs to the second.
inline std::array<int, 2> cells_of(const std::array<double, 2>& range) {
  const int first = static_cast<int>(std::floor(range[0]));
  return {first, std::max(first, static_cast<int>(std::ceil(range[1])) - 1)};
}

/// Calls visit(cell, part) for the parts of a piece in the cells first..last along an axis; what
/// lies before the first one is given as that of cell first - 1.
template <class Visit>
void for_cells_along(Piece piece, int axis, int first, int last, const Visit& visit) {
  if (piece.n < 3) return;
  const std::array<int, 2> cells = cells_of(piece.range(axis));
  int cell = cells[0];
  const int end = cells[1];
  Piece below, above;
  const auto cut_off = [&](int at) {
    split(piece, axis, at, below, above);
    piece = above;
  };
  if (cell < first) {
    if (end < first) return visit(first - 1, piece);
    cut_off(first);
    visit(first - 1, below);
    cell = first;
  }
  for (; cell < end && cell <= last; ++cell) {
    cut_off(cell + 1);
    visit(cell, below);
  }
  if (cell <= last) visit(cell, piece);
}

/// A rule on triangles that is exact for polynomials of degree 7.
struct PieceRule {
  std::array<Eigen::Vector3d, 13> points;  ///< barycentric
  std::array<double, 13> weights;          ///< their sum is 1; the first is negative
};
const PieceRule& piece_rule();

/// Calls visit(a, b, c) for the triangles of a fan that make up the piece.
template <class Visit>
void for_triangles_of(const Piece& piece, const Visit& visit) {
  for (int m = 1; m + 1 < piece.n; ++m)
    visit(piece.corners[0], piece.corners[m], piece.corners[m + 1]);
}

}  // namespace surf::volume
