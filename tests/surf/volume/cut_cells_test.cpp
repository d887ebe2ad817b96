#include "libsurf/volume/cut_cells.h"

#include <cmath>

#include "libsurf/fem/quadrature.h"
#include "libsurf/volume/cell_pieces.h"
#include "tests/surf/volume/cut_surfaces.h"

namespace surf::volume {
namespace {

Moments moments_of(const DomainCells& cells, std::size_t n) {
  const std::int32_t state = cells.state[n];
  if (state == DomainCells::kEmpty) return {};
  return state == DomainCells::kFull ? fem::full_moments() : cells.moments[state];
}

/// Integral of f(u) = 1 + u_0 u_1^2 - 2 u_2^2 over the domain, u the grid's indices, from the
/// moments of its cells.
double integral_of_indices(const DomainCells& cells, const Grid& grid) {
  double sum = 0;
  for (int k = 0; k < cells.size[2]; ++k)
    for (int j = 0; j < cells.size[1]; ++j)
      for (int i = 0; i < cells.size[0]; ++i) {
        const Moments m = moments_of(cells, cells.cell(i, j, k));
        const auto at = [&](int a, int b, int c) { return m[9 * c + 3 * b + a]; };
        const double mixed = i * (double(j) * j * at(0, 0, 0) + 2 * j * at(0, 1, 0) + at(0, 2, 0)) +
                             double(j) * j * at(1, 0, 0) + 2 * j * at(1, 1, 0) + at(1, 2, 0);
        const double square = double(k) * k * at(0, 0, 0) + 2 * k * at(0, 0, 1) + at(0, 0, 2);
        sum += at(0, 0, 0) + mixed - 2 * square;
      }
  return sum * std::abs(grid.index_to_world.linear().determinant());
}

/// The same by the divergence theorem: int_Gamma P nu_2 dS with dP/du_2 = f.
double exact_integral_of_indices(const test::Arrays<3>& surface, const Grid& grid) {
  const Eigen::Affine3d to_index = grid.index_to_world.inverse();
  const PieceRule& rule = piece_rule();
  double sum = 0;
  for (const auto t : surface.T.rowwise()) {
    const Eigen::Vector3d a = to_index * Eigen::Vector3d(surface.X.row(t[0])),
                          b = to_index * Eigen::Vector3d(surface.X.row(t[1])),
                          c = to_index * Eigen::Vector3d(surface.X.row(t[2]));
    const double area = 0.5 * (b - a).cross(c - a)[2];
    for (std::size_t q = 0; q < rule.weights.size(); ++q) {
      const Eigen::Vector3d u =
          rule.points[q][0] * a + rule.points[q][1] * b + rule.points[q][2] * c;
      const double P = u[2] * (1 + u[0] * u[1] * u[1]) - 2 * u[2] * u[2] * u[2] / 3;
      sum += area * rule.weights[q] * P;
    }
  }
  return sum * grid.index_to_world.linear().determinant();
}

TEST(PieceRule, IsExactToDegreeSeven) {
  const PieceRule& rule = piece_rule();
  constexpr double kTolerance = 1e-14;  // the digits of its constants
  for (int p = 0; p <= 7; ++p)
    for (int q = 0; p + q <= 7; ++q) {
      double sum = 0;
      for (std::size_t n = 0; n < rule.weights.size(); ++n)
        sum += rule.weights[n] * std::pow(rule.points[n][0], p) * std::pow(rule.points[n][1], q);
      // int over the triangle, of area 1: 2 p! q! / (p + q + 2)!
      const double exact = 2 * std::tgamma(p + 1) * std::tgamma(q + 1) / std::tgamma(p + q + 3);
      EXPECT_NEAR(sum, exact, kTolerance) << p << ", " << q;
    }
}

TEST(CutCells, MomentsAddUpToTheIntegralsOverTheDomain) {
  constexpr double kTolerance = 1e-12;  // rounding of 10^3 cells' sums
  for (const bool is_mirrored : {false, true}) {
    const Grid grid = oblique_grid(13, is_mirrored);
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const auto surface = test::random_smooth_shape<3>(seed, 3);
      const auto [inside, outside] = cut_cells(surface.X, surface.T, grid);
      const double exact = exact_integral_of_indices(surface, grid);
      EXPECT_NEAR(integral_of_indices(inside, grid), exact, kTolerance * std::abs(exact)) << seed;
      DomainCells whole = inside;
      std::fill(whole.state.begin(), whole.state.end(), DomainCells::kFull);
      const double all = integral_of_indices(whole, grid);
      EXPECT_NEAR(integral_of_indices(outside, grid), all - exact, kTolerance * std::abs(all));
    }
  }
}

TEST(CutCells, AreThoseOfWhatLiesInTheGridIfTheSurfaceReachesOut) {
  constexpr double kTolerance = 1e-12;
  const Grid grid{{6, 7, 8}, Eigen::Affine3d::Identity()};
  const Eigen::Affine3d motion(Eigen::Translation3d(-2.5, -1.25, 3.5));
  const auto surface = box_surface({5, 4, 10}, motion);  // [-2.5, 2.5] x [-1.25, 2.75] x [3.5, ..]
  const auto [inside, outside] = cut_cells(surface.X, surface.T, grid);
  double sum = 0, rest = 0;
  for (std::size_t n = 0; n < inside.state.size(); ++n) {
    sum += moments_of(inside, n)[0];
    rest += moments_of(outside, n)[0];
  }
  EXPECT_NEAR(sum, 2.5 * 2.75 * 3.5, kTolerance);
  EXPECT_NEAR(rest, 5 * 6 * 7 - sum, 100 * kTolerance);
}

TEST(CutCells, AFaceInAPlaneOfTheGridCutsNothing) {
  const Grid grid{{6, 6, 6}, Eigen::Affine3d::Identity()};
  const auto surface = box_surface({2, 3, 1}, Eigen::Affine3d(Eigen::Translation3d(1, 1, 2)));
  const auto [inside, outside] = cut_cells(surface.X, surface.T, grid);
  EXPECT_TRUE(inside.moments.empty());
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i) {
        const bool is_in = i >= 1 && i < 3 && j >= 1 && j < 4 && k == 2;
        EXPECT_EQ(inside.at(i, j, k), is_in ? DomainCells::kFull : DomainCells::kEmpty);
        EXPECT_EQ(outside.at(i, j, k), is_in ? DomainCells::kEmpty : DomainCells::kFull);
      }
}

TEST(CutCells, WhatIsCoveredTwiceIsInsideOnce) {
  const Grid grid{{9, 9, 9}, Eigen::Affine3d::Identity()};
  const auto first = box_surface({4, 4, 4}, Eigen::Affine3d(Eigen::Translation3d(1.5, 1.5, 1.5)));
  const auto second = box_surface({4, 4, 4}, Eigen::Affine3d(Eigen::Translation3d(2.5, 2.5, 2.5)));
  Points<3> X(16, 3);
  X << first.X, second.X;
  Elements<3> T(24, 3);
  T << first.T, (second.T.array() + 8).matrix();
  const auto [inside, outside] = cut_cells(X, T, grid);
  EXPECT_EQ(inside.at(3, 3, 3), DomainCells::kFull);
  double sum = 0;
  for (std::size_t n = 0; n < inside.state.size(); ++n) {
    const double share = moments_of(inside, n)[0];
    EXPECT_GE(share, 0);
    EXPECT_LE(share, 1);
    EXPECT_NEAR(share + moments_of(outside, n)[0], 1, 1e-14);
    sum += share;
  }
  // 64 + 64 - 27, but for the cells where faces of both meet
  EXPECT_NEAR(sum, 101, 8);
}

TEST(CutCells, CoarseCellsHoldTheDomainOfTheirChildren) {
  constexpr double kTolerance = 1e-12;
  const auto surface = test::random_smooth_shape<3>(5, 3);
  const Grid grid = oblique_grid(13);
  const auto fine = cut_cells(surface.X, surface.T, grid)[0];
  for (const std::array<int, 3>& factor : {std::array{2, 2, 2}, std::array{2, 1, 2}}) {
    Grid wide = grid;
    for (int axis = 0; axis < 3; ++axis) {
      wide.size[axis] = (grid.size[axis] - 1 + factor[axis] - 1) / factor[axis] + 1;
      wide.index_to_world.linear().col(axis) *= factor[axis];
    }
    const DomainCells direct = cut_cells(surface.X, surface.T, wide)[0];
    const DomainCells coarse = coarsened(fine, factor);
    ASSERT_EQ(coarse.size, direct.size);
    for (std::size_t n = 0; n < direct.state.size(); ++n) {
      const Moments a = moments_of(coarse, n), b = moments_of(direct, n);
      for (int m = 0; m < 27; ++m) EXPECT_NEAR(a[m], b[m], kTolerance) << n << ", " << m;
    }
  }
}

}  // namespace
}  // namespace surf::volume
