#include "libsurf/fem/quadrature.h"

#include <array>
#include <cmath>
#include <stdexcept>

namespace surf::fem {
namespace {

/// Gauss-Legendre on [-1, 1] with 1, 2 or 3 points, in barycentric coordinates.
Quadrature<2> gauss(int n_points) {
  Quadrature<2> rule;
  Eigen::VectorXd x(n_points);
  rule.weights.resize(n_points);
  if (n_points == 1) {
    x << 0;
    rule.weights << 1;
  } else if (n_points == 2) {
    x << -1 / std::sqrt(3.0), 1 / std::sqrt(3.0);
    rule.weights << 0.5, 0.5;
  } else {
    x << -std::sqrt(0.6), 0, std::sqrt(0.6);
    rule.weights << 5.0 / 18, 8.0 / 18, 5.0 / 18;
  }
  rule.points.resize(n_points, 2);
  rule.points.col(0) = (1 - x.array()) / 2;
  rule.points.col(1) = (1 + x.array()) / 2;
  return rule;
}

/// Appends the three points (1 - 2 a, a, a) and its permutations, each of weight w.
void append_orbit(Quadrature<3>& rule, double a, double w) {
  const Eigen::Index at = rule.size();
  rule.points.conservativeResize(at + 3, 3);
  rule.weights.conservativeResize(at + 3);
  for (int i = 0; i < 3; ++i) {
    rule.points.row(at + i).setConstant(a);
    rule.points(at + i, i) = 1 - 2 * a;
    rule.weights[at + i] = w;
  }
}

Quadrature<3> triangle_centroid(double weight) {
  Quadrature<3> rule;
  rule.points = Eigen::RowVector3d::Constant(1.0 / 3);
  rule.weights = Eigen::VectorXd::Constant(1, weight);
  return rule;
}

Quadrature<3> triangle(int order) {
  if (order == 1) return triangle_centroid(1);
  Quadrature<3> rule;
  if (order == 2) {
    append_orbit(rule, 1.0 / 6, 1.0 / 3);
  } else if (order <= 4) {
    append_orbit(rule, 0.445948490915964886318329253883, 0.223381589678011465691250074834);
    append_orbit(rule, 0.091576213509770743459571463402, 0.109951743655321867642083258499);
  } else {
    rule = triangle_centroid(9.0 / 40);
    append_orbit(rule, (6 - std::sqrt(15.0)) / 21, (155 - std::sqrt(15.0)) / 1200);
    append_orbit(rule, (6 + std::sqrt(15.0)) / 21, (155 + std::sqrt(15.0)) / 1200);
  }
  return rule;
}

template <int Dim>
Quadrature<Dim> make_rule(int order) {
  if constexpr (Dim == 2)
    return gauss((order + 2) / 2);
  else
    return triangle(order);
}

}  // namespace

template <int Dim>
const Quadrature<Dim>& quadrature(int order) {
  static const std::array<Quadrature<Dim>, 5> rules = {make_rule<Dim>(1), make_rule<Dim>(2),
                                                       make_rule<Dim>(3), make_rule<Dim>(4),
                                                       make_rule<Dim>(5)};
  if (order < 1 || order > 5) throw std::out_of_range("quadrature: order must be 1 to 5");
  return rules[order - 1];
}

template const Quadrature<2>& quadrature<2>(int);
template const Quadrature<3>& quadrature<3>(int);

}  // namespace surf::fem
