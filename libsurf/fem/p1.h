// P1 elements: piecewise linear basis functions on simplices, those of surfaces and of domains.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

namespace surf::fem {

/// Row i: gradient of the basis function of corner i [1/mm], with the Jacobian J = (x_1 - x_0,
/// ...): J (J^T J)^-1 grad phi_i. Of a simplex of fewer dimensions than its space, as an element of
/// a surface is, the tangential one.
///
/// @param X  row i: corner i [mm]
template <int Corners, int Dim>
Eigen::Matrix<double, Corners, Dim> p1_gradients(const Eigen::Matrix<double, Corners, Dim>& X) {
  Eigen::Matrix<double, Dim, Corners - 1> J;
  for (int i = 1; i < Corners; ++i) J.col(i - 1) = X.row(i) - X.row(0);
  const Eigen::Matrix<double, Corners - 1, Corners - 1> metric = J.transpose() * J;
  const Eigen::Matrix<double, Corners - 1, Dim> rows = (J * metric.inverse()).transpose();
  Eigen::Matrix<double, Corners, Dim> out;
  out.template bottomRows<Corners - 1>() = rows;
  out.row(0) = -rows.colwise().sum();
  return out;
}

/// <grad phi_i, grad phi_j> over a simplex of this measure.
template <int Corners, int Dim>
Eigen::Matrix<double, Corners, Corners> p1_stiffness(
    const Eigen::Matrix<double, Corners, Dim>& gradients, double measure) {
  return measure * gradients * gradients.transpose();
}

/// <phi_i, phi_j>: measure (1 + delta_ij) / (Corners (Corners + 1)).
template <int Corners>
Eigen::Matrix<double, Corners, Corners> p1_mass(double measure) {
  using Matrix = Eigen::Matrix<double, Corners, Corners>;
  return measure / (Corners * (Corners + 1)) * (Matrix::Ones() + Matrix::Identity());
}

}  // namespace surf::fem
