// Linear solvers for the velocity systems on a ball in a wavy field: iterations and times per
// solve.
#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <chrono>
#include <cmath>
#include <unsupported/Eigen/IterativeSolvers>

#include "libsurf/fem/stiffness.h"
#include "libsurf/mesh/primitives.h"

namespace {

using namespace surf;

/// Median seconds of five runs of `solve`, which returns its iterations.
template <class Solve>
void report(const char* name, Eigen::Index n, const Solve& solve) {
  std::vector<double> seconds;
  long iterations = 0;
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    iterations = solve();
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(seconds.begin(), seconds.end());
  fmt::print("{:>9} {:<34} {:>11} {:>9.2f}\n", n, name, iterations, 1e3 * seconds[2]);
}

template <class Solver>
void report_iterative(const char* name, const SparseMatrix& matrix, const Eigen::VectorXd& rhs) {
  report(name, matrix.rows(), [&] {
    Solver solver;
    solver.setTolerance(1e-8);
    solver.compute(matrix);
    const Eigen::VectorXd x = solver.solve(rhs);
    return x.allFinite() ? long(solver.iterations()) : -1L;
  });
}

void run(double edge_length) {
  const Triangles ball = mesh::ball({0, 0, 0}, 1, edge_length);
  const fem::Geometry<3> shape(ball.points, ball.elements);
  const Eigen::Index n = shape.n_vertices();
  // Edge indicator between 0.05 and 1 over the surface; beta as at an edge and far from it.
  Eigen::VectorXd alpha(shape.n_elements()), g(n), rhs(n), beta(n);
  const auto H = [](const Eigen::RowVector3d& x) {
    return 0.05 + 0.95 * std::pow(std::sin(4 * x[0] + x[1]), 2);
  };
  for (Eigen::Index t = 0; t < alpha.size(); ++t)
    alpha[t] = H(ball.points.row(ball.elements(t, 0)));
  for (Eigen::Index i = 0; i < n; ++i) {
    g[i] = H(ball.points.row(i));
    beta[i] = shape.lumped_mass()[i] * (100 + 3000 * (1 - g[i]));
    rhs[i] = shape.lumped_mass()[i] * std::cos(7 * ball.points(i, 2) + ball.points(i, 0));
  }
  SparseMatrix h1 = fem::stiffness<3>(shape, alpha);
  for (Eigen::Index i = 0; i < n; ++i) h1.coeffRef(i, i) += beta[i];
  const SparseMatrix A = fem::stiffness<3>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
  const SparseMatrix S = fem::normal_stiffness<3>(shape, A);
  const Eigen::VectorXd root = g.cwiseSqrt();
  SparseMatrix l2 = root.asDiagonal() * S * root.asDiagonal();
  l2 *= 0.01;
  for (Eigen::Index i = 0; i < n; ++i) l2.coeffRef(i, i) += shape.lumped_mass()[i];
  const SparseMatrix weighted = g.asDiagonal() * S;
  const SparseMatrix implicit_h1 = h1 + 0.5 * weighted;

  using Matrix = surf::SparseMatrix;
  using Diagonal = Eigen::DiagonalPreconditioner<double>;
  constexpr int kBoth = Eigen::Lower | Eigen::Upper;
  for (const auto& [name, matrix] : {std::pair{"H1", &h1}, std::pair{"L2 semi-implicit", &l2}}) {
    report_iterative<Eigen::ConjugateGradient<Matrix, kBoth, Diagonal>>(
        fmt::format("{}: CG, diagonal", name).c_str(), *matrix, rhs);
    report_iterative<Eigen::ConjugateGradient<Matrix, kBoth, Eigen::IncompleteCholesky<double>>>(
        fmt::format("{}: CG, incomplete Cholesky", name).c_str(), *matrix, rhs);
    report(fmt::format("{}: LDLT", name).c_str(), n, [&, &matrix = matrix] {
      Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(*matrix);
      return Eigen::VectorXd(solver.solve(rhs)).allFinite() ? 0L : -1L;
    });
  }
  report_iterative<Eigen::BiCGSTAB<Matrix, Diagonal>>("H1 semi-implicit: BiCGSTAB, diagonal",
                                                      implicit_h1, rhs);
  report_iterative<Eigen::GMRES<Matrix, Diagonal>>("H1 semi-implicit: GMRES, diagonal", implicit_h1,
                                                   rhs);
}

}  // namespace

int main() {
  fmt::print("{:>9} {:<34} {:>11} {:>9}\n", "vertices", "system: solver", "iterations", "ms");
  for (const double edge_length : {0.06, 0.03, 0.015}) run(edge_length);
}
