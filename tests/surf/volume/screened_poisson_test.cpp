// The two Neumann problems of Mumford and Shah on domains that cut the grid's cells.
#include "libsurf/volume/screened_poisson.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "libsurf/base/log.h"
#include "libsurf/base/random.h"
#include "libsurf/base/threads.h"
#include "libsurf/volume/cell_pieces.h"
#include "libsurf/volume/detail/cut_matrix.h"
#include "tests/surf/volume/cut_surfaces.h"

namespace surf::volume {
namespace {

using Function = std::function<double(const Eigen::Vector3d&)>;
using Gradient = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

struct Problem {
  Grid grid;
  DomainCells cells;
  std::vector<double> I;
};

/// @param side  0 inside, 1 outside
Problem make_problem(const test::Arrays<3>& surface, const Grid& grid, const Function& I,
                     int side = 0) {
  Problem out{grid, cut_cells(surface.X, surface.T, grid)[side], {}};
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        out.I.push_back(I(grid.index_to_world * Eigen::Vector3d(i, j, k)));
  return out;
}

struct Errors {
  double l2 = 0, h1 = 0;
};

/// Of the trilinear solution in a cell, at its middle weighted by what lies inside: in L2 and, of
/// the gradient, in H1. The middle of a cell is where gradients are more accurate than elsewhere,
/// so the gradient is taken at a third of the cell's length instead.
Errors errors(const ScreenedPoisson& solution, const Problem& problem, const Function& u,
              const Gradient& grad_u) {
  const DomainCells& cells = problem.cells;
  const Eigen::Matrix3d to_world = problem.grid.index_to_world.linear().inverse().transpose();
  const double volume = std::abs(problem.grid.index_to_world.linear().determinant());
  const Eigen::Vector3d x(1.0 / 3, 1.0 / 3, 1.0 / 3);
  Errors sum;
  for (int k = 0; k < cells.size[2]; ++k)
    for (int j = 0; j < cells.size[1]; ++j)
      for (int i = 0; i < cells.size[0]; ++i) {
        const std::int32_t state = cells.at(i, j, k);
        if (state == DomainCells::kEmpty) continue;
        const double share = state == DomainCells::kFull ? 1 : cells.moments[state][0];
        const auto corners = solution.corner_values(i, j, k);
        double value = 0;
        Eigen::Vector3d slope = Eigen::Vector3d::Zero();
        for (int a = 0; a < 8; ++a) {
          Eigen::Vector3d w, d;
          for (int axis = 0; axis < 3; ++axis) {
            const bool is_upper = a >> axis & 1;
            w[axis] = is_upper ? x[axis] : 1 - x[axis];
            d[axis] = is_upper ? 1 : -1;
          }
          value += corners[a] * w.prod();
          slope += corners[a] *
                   Eigen::Vector3d(d[0] * w[1] * w[2], w[0] * d[1] * w[2], w[0] * w[1] * d[2]);
        }
        const Eigen::Vector3d at = problem.grid.index_to_world * (Eigen::Vector3d(i, j, k) + x);
        sum.l2 += volume * share * std::pow(value - u(at), 2);
        sum.h1 += volume * share * (to_world * slope - grad_u(at)).squaredNorm();
      }
  return {std::sqrt(sum.l2), std::sqrt(sum.h1)};
}

/// u = prod cos(pi x_a / side_a) in the frame of a box, whose normal derivative vanishes on it.
struct BoxSolution {
  Eigen::Vector3d sides{1.7, 1.3, 1.1};
  Eigen::Affine3d motion = Eigen::Translation3d(-0.6, -0.9, -0.3) *
                           Eigen::AngleAxisd(0.3, Eigen::Vector3d(3, 1, 2).normalized());
  double mu = 0.3;

  double u(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d y = motion.inverse() * x;
    double product = 1;
    for (int a = 0; a < 3; ++a) product *= std::cos(std::numbers::pi * y[a] / sides[a]);
    return product;
  }
  Eigen::Vector3d gradient(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d y = motion.inverse() * x;
    Eigen::Vector3d out;
    for (int d = 0; d < 3; ++d) {
      out[d] = 1;
      for (int a = 0; a < 3; ++a) {
        const double k = std::numbers::pi / sides[a];
        out[d] *= a == d ? -k * std::sin(k * y[a]) : std::cos(k * y[a]);
      }
    }
    return motion.linear() * out;
  }
  double I(const Eigen::Vector3d& x) const {
    double sum = 0;
    for (int a = 0; a < 3; ++a) sum += std::pow(std::numbers::pi / sides[a], 2);
    return (1 + mu * sum) * u(x);
  }
};

TEST(ScreenedPoisson, ConvergesInABoxThatCutsAnObliqueGrid) {
  const BoxSolution exact;
  const auto surface = box_surface(exact.sides, exact.motion);
  Errors coarse, fine;
  for (Errors* error : {&coarse, &fine}) {
    const Problem problem = make_problem(surface, oblique_grid(error == &coarse ? 20 : 40),
                                         [&](const auto& x) { return exact.I(x); });
    ScreenedPoisson solution(problem.cells, problem.grid, exact.mu, problem.I, {1e-10, 200});
    *error = errors(
        solution, problem, [&](const auto& x) { return exact.u(x); },
        [&](const auto& x) { return exact.gradient(x); });
  }
  EXPECT_GT(std::log2(coarse.l2 / fine.l2), 1.8) << coarse.l2 << ", " << fine.l2;
  EXPECT_GT(std::log2(coarse.h1 / fine.h1), 0.9) << coarse.h1 << ", " << fine.h1;
  EXPECT_LT(fine.l2, 0.02);  // of a norm of 0.55
}

// Outside the unit ball: u = f(r) with f' = (r - 1) exp(-r)-like slopes that vanish on it, so far
// away that the grid's sides do not count.
TEST(ScreenedPoisson, ConvergesInsideAndOutsideOfABall) {
  constexpr double kMu = 0.05, kRadius = 0.8;
  // u = 1 + exp(-q (r^2 - R^2)^2): its normal derivative vanishes at r = R
  constexpr double q = 3;
  const auto s = [](const Eigen::Vector3d& x) { return x.squaredNorm() - kRadius * kRadius; };
  const Function u = [&](const auto& x) { return 1 + std::exp(-q * s(x) * s(x)); };
  const Gradient grad_u = [&](const auto& x) {
    return Eigen::Vector3d(-4 * q * s(x) * std::exp(-q * s(x) * s(x)) * x);
  };
  // Lap exp(p) = exp(p) (Lap p + |grad p|^2), p = -q s^2: grad p = -4 q s x,
  // Lap p = -4 q (3 s + 2 r^2)
  const Function I = [&](const auto& x) {
    const double r2 = x.squaredNorm();
    const double lap = std::exp(-q * s(x) * s(x)) *
                       (-4 * q * (3 * s(x) + 2 * r2) + std::pow(4 * q * s(x), 2) * r2);
    return u(x) - kMu * lap;
  };
  for (const int side : {0, 1}) {
    Errors coarse, fine;
    for (Errors* error : {&coarse, &fine}) {
      const bool is_coarse = error == &coarse;
      test::Arrays<3> surface = test::unit_sphere<3>(is_coarse ? 4 : 5);
      surface.X *= kRadius;
      const Problem problem = make_problem(surface, oblique_grid(is_coarse ? 24 : 48), I, side);
      ScreenedPoisson solution(problem.cells, problem.grid, kMu, problem.I, {1e-10, 200});
      *error = errors(solution, problem, u, grad_u);
    }
    EXPECT_GT(std::log2(coarse.l2 / fine.l2), 1.8) << side << ": " << coarse.l2;
    EXPECT_GT(std::log2(coarse.h1 / fine.h1), 0.9) << side << ": " << coarse.h1;
  }
}

Problem wavy_problem(int n) {
  return make_problem(test::random_smooth_shape<3>(4, 4), oblique_grid(n), [](const auto& x) {
    return std::cos(5 * x[0]) + std::sin(9 * x[1] + x[2]) + 7;
  });
}

TEST(ScreenedPoisson, IterationsHardlyDependOnTheGridAndTheSmoothingLength) {
  for (const double mu : {0.003, 0.1, 3.0})
    for (const int n : {16, 33, 64}) {
      const Problem problem = wavy_problem(n);
      ScreenedPoisson solution(problem.cells, problem.grid, mu, problem.I, {1e-8, 100});
      EXPECT_LE(solution.n_iterations(), 12) << "mu " << mu << ", " << n << " cells";
    }
}

TEST(ScreenedPoisson, ConstantsAreTheirOwnSolution) {
  const auto surface = test::random_smooth_shape<3>(4, 3);
  const Problem problem = make_problem(surface, oblique_grid(20), [](const auto&) { return 3.0; });
  ScreenedPoisson solution(problem.cells, problem.grid, 0.2, problem.I);
  EXPECT_NEAR(solution.energy(), 0, 1e-12);
  EXPECT_NEAR(solution.corner_values(10, 10, 10)[3], 3, 1e-12);
}

TEST(ScreenedPoisson, EnergyIsTheLeastOneAndCloserThanTheSolution) {
  const Problem problem = wavy_problem(20);
  ScreenedPoisson exact(problem.cells, problem.grid, 0.1, problem.I, {1e-12, 200});
  ScreenedPoisson rough(problem.cells, problem.grid, 0.1, problem.I, {1e-3, 200});
  EXPECT_GT(rough.energy(), exact.energy());
  EXPECT_LT(rough.energy() - exact.energy(), 1e-5 * exact.energy());
}

TEST(ScreenedPoisson, TellsWhetherItConverged) {
  const Problem problem = wavy_problem(16);
  std::vector<std::string> messages;
  set_log_sink([&](LogLevel, const std::string& message) { messages.push_back(message); });
  const ScreenedPoisson whole(problem.cells, problem.grid, 0.1, problem.I);
  EXPECT_TRUE(whole.has_converged());
  EXPECT_TRUE(messages.empty());
  const ScreenedPoisson cut_short(problem.cells, problem.grid, 0.1, problem.I, {1e-5, 2});
  set_log_sink({});
  EXPECT_FALSE(cut_short.has_converged());
  EXPECT_EQ(cut_short.n_iterations(), 2);
  ASSERT_EQ(messages.size(), 1);
  EXPECT_THAT(messages[0], ::testing::HasSubstr("above 1e-05 of the load after 2 iterations"));
}

TEST(ScreenedPoisson, AWarmStartSavesIterations) {
  const ScreenedPoissonOptions options{.tolerance = 1e-5};
  const Problem problem = wavy_problem(32);
  const ScreenedPoisson first(problem.cells, problem.grid, 0.1, problem.I, options);
  const ScreenedPoisson again(problem.cells, problem.grid, 0.1, problem.I, options, &first);
  EXPECT_EQ(again.n_iterations(), 0);
  auto moved = test::random_smooth_shape<3>(4, 4);
  moved.X *= 1.002;
  const ScreenedPoisson next(cut_cells(moved.X, moved.T, problem.grid)[0], problem.grid, 0.1,
                             problem.I, options, &first);
  EXPECT_LT(next.n_iterations(), first.n_iterations());
}

// The same box with one more layer of cells round it: values are found where they were.
TEST(ScreenedPoisson, AStartOnAnotherGridIsTheSame) {
  const Problem problem = wavy_problem(32);
  const ScreenedPoisson first(problem.cells, problem.grid, 0.1, problem.I);
  Grid wider = problem.grid;
  for (int& size : wider.size) size += 2;
  wider.index_to_world.translate(Eigen::Vector3d(-1, -1, -1));
  const auto surface = test::random_smooth_shape<3>(4, 4);
  std::vector<double> I(std::size_t(wider.size[0]) * wider.size[1] * wider.size[2], 0.0);
  for (int k = 0; k <= 32; ++k)
    for (int j = 0; j <= 32; ++j)
      for (int i = 0; i <= 32; ++i)
        I[(std::size_t(k + 1) * 35 + j + 1) * 35 + i + 1] =
            problem.I[(std::size_t(k) * 33 + j) * 33 + i];
  const ScreenedPoisson second(cut_cells(surface.X, surface.T, wider)[0], wider, 0.1, I, {}, &first,
                               {-1, -1, -1});
  EXPECT_EQ(second.n_iterations(), 0);
  EXPECT_NEAR(second.energy(), first.energy(), 1e-9 * first.energy());
}

TEST(ScreenedPoisson, SolutionDoesNotDependOnTheNumberOfThreads) {
  const Problem problem = wavy_problem(24);
  std::vector<double> values;
  for (const int n_threads : {1, 2}) {
    const ThreadLimit limit(n_threads);
    ScreenedPoisson solution(problem.cells, problem.grid, 0.1, problem.I);
    for (int i = 0; i < 25; ++i) values.push_back(solution.node_value(i, 12, 12));
    values.push_back(solution.energy());
  }
  for (std::size_t n = 0; n < values.size() / 2; ++n)
    EXPECT_EQ(values[n], values[n + values.size() / 2]);
}

TEST(ScreenedPoissonInverse, UndoesTheMatrix) {
  const Problem problem = wavy_problem(24);
  const ScreenedPoissonOptions options{.tolerance = 1e-10};
  const CutMatrix A(blended(problem.cells, options.blend), problem.grid.index_to_world.linear(), 1,
                    0.1);
  const PaddedGrid& box = A.box();
  Values v(box.n_values()), product(box.n_values());
  for (std::size_t n = 0; n < v.size(); ++n)
    if (A.is_active(n)) v[n] = uniform_random(1, n) - 0.5;
  A.multiply(v, product);
  const auto at_nodes = [&](const Values& values) {
    Eigen::VectorXd out(std::ptrdiff_t(problem.I.size()));
    Eigen::Index n = 0;
    for (int k = 0; k < box.size[2]; ++k)
      for (int j = 0; j < box.size[1]; ++j)
        for (int i = 0; i < box.size[0]; ++i) out[n++] = values[box.at(i, j, k)];
    return out;
  };
  const ScreenedPoissonInverse inverse(problem.cells, problem.grid, 0.1, options);
  EXPECT_LT((inverse(at_nodes(product)) - at_nodes(v)).norm(), 1e-6 * at_nodes(v).norm());
}

}  // namespace
}  // namespace surf::volume
