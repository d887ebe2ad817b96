#include "libsurf/segment/detail/faded_moves.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <stdexcept>

#include "libsurf/fem/stiffness.h"

namespace surf::segment {
namespace {

constexpr double kLeastMass = 1e-3;  // of the mean: on the border alone vertices have none

using Sparse = Eigen::SparseMatrix<double>;

}  // namespace

template <int Dim>
Eigen::VectorXd faded_moves(const fem::Geometry<Dim>& geometry, const Eigen::VectorXd& moves,
                            const std::vector<char>& is_known, double reach_mm) {
  std::vector<int> unknown(is_known.size(), -1);
  int n = 0;
  for (std::size_t i = 0; i < unknown.size(); ++i)
    if (!is_known[i]) unknown[i] = n++;
  if (n == 0) return moves;
  const Eigen::VectorXd& mass = geometry.lumped_mass();
  const double least = kLeastMass * mass.mean();
  const Sparse A = fem::stiffness<Dim>(geometry, Eigen::VectorXd::Ones(geometry.n_elements()));
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  for (int column = 0; column < A.outerSize(); ++column) {
    const int other = unknown[std::size_t(column)];
    if (other >= 0)
      entries.emplace_back(other, other, std::max(mass[column], least) / (reach_mm * reach_mm));
    for (Sparse::InnerIterator entry(A, column); entry; ++entry) {
      const int row = unknown[std::size_t(entry.row())];
      if (row < 0) continue;
      if (other >= 0)
        entries.emplace_back(row, other, entry.value());
      else
        b[row] -= entry.value() * moves[column];
    }
  }
  Sparse K(n, n);
  K.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(K);
  if (solver.info() != Eigen::Success)
    throw std::logic_error("faded moves: the system cannot be solved");
  const Eigen::VectorXd found = solver.solve(b);
  Eigen::VectorXd out = moves;
  for (std::size_t i = 0; i < unknown.size(); ++i)
    if (unknown[i] >= 0) out[Eigen::Index(i)] = found[unknown[i]];
  return out;
}

template Eigen::VectorXd faded_moves<2>(const fem::Geometry<2>&, const Eigen::VectorXd&,
                                        const std::vector<char>&, double);
template Eigen::VectorXd faded_moves<3>(const fem::Geometry<3>&, const Eigen::VectorXd&,
                                        const std::vector<char>&, double);

}  // namespace surf::segment
