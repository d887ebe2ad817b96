#include "libsurf/fem/trilinear.h"

#include <cmath>

namespace surf::fem {
namespace {

/// Functions of one coordinate that products of l_0 = 1 - x, l_1 = x and their derivatives are
/// made of, and their coefficients for 1, x, x^2.
enum Function { kBoth0, kMixed, kBoth1, kOnly0, kOnly1, kOne };
constexpr double kCoefficients[6][3] = {{1, -2, 1}, {0, 1, -1}, {0, 0, 1},
                                        {1, -1, 0}, {0, 1, 0},  {1, 0, 0}};

/// Integrals of f(x) g(y) h(z) for all triples of functions.
class Integrals {
 public:
  explicit Integrals(const Moments& moments) {
    std::array<double, 6 * 9> along_x{};  // f, b, c
    for (int f = 0; f < 6; ++f)
      for (int bc = 0; bc < 9; ++bc)
        for (int a = 0; a < 3; ++a)
          along_x[f * 9 + bc] += kCoefficients[f][a] * moments[bc * 3 + a];
    std::array<double, 36 * 3> along_y{};  // f, g, c
    for (int f = 0; f < 6; ++f)
      for (int g = 0; g < 6; ++g)
        for (int c = 0; c < 3; ++c)
          for (int b = 0; b < 3; ++b)
            along_y[(f * 6 + g) * 3 + c] += kCoefficients[g][b] * along_x[f * 9 + c * 3 + b];
    for (int fg = 0; fg < 36; ++fg)
      for (int h = 0; h < 6; ++h) {
        values_[fg * 6 + h] = 0;
        for (int c = 0; c < 3; ++c)
          values_[fg * 6 + h] += kCoefficients[h][c] * along_y[fg * 3 + c];
      }
  }

  double operator()(const std::array<int, 3>& f) const {
    return values_[(f[0] * 6 + f[1]) * 6 + f[2]];
  }

 private:
  std::array<double, 216> values_;
};

Moments make_full_moments() {
  Moments out;
  for (int c = 0; c < 3; ++c)
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a) out[(c * 3 + b) * 3 + a] = 1.0 / ((a + 1) * (b + 1) * (c + 1));
  return out;
}

std::array<int, 3> corner(int number) { return {number & 1, number >> 1 & 1, number >> 2}; }

Function product(int a, int b) { return a != b ? kMixed : a == 0 ? kBoth0 : kBoth1; }
Function single(int a) { return a == 0 ? kOnly0 : kOnly1; }
double slope(int a) { return a == 0 ? -1 : 1; }

double mass_entry(const Integrals& integrals, const std::array<int, 3>& a,
                  const std::array<int, 3>& b) {
  return integrals({product(a[0], b[0]), product(a[1], b[1]), product(a[2], b[2])});
}

/// int d_p phi_a d_q phi_b
double slope_entry(const Integrals& integrals, const std::array<int, 3>& a,
                   const std::array<int, 3>& b, int p, int q) {
  std::array<int, 3> f = {product(a[0], b[0]), product(a[1], b[1]), product(a[2], b[2])};
  if (p == q) {
    f[p] = kOne;
  } else {
    f[p] = single(b[p]);
    f[q] = single(a[q]);
  }
  return slope(a[p]) * slope(b[q]) * integrals(f);
}

}  // namespace

const Moments& full_moments() {
  static const Moments moments = make_full_moments();
  return moments;
}

std::array<double, 8> trilinear_values(const Eigen::Vector3d& x) {
  std::array<double, 8> out;
  for (int a = 0; a < 8; ++a)
    out[a] = (a & 1 ? x[0] : 1 - x[0]) * (a & 2 ? x[1] : 1 - x[1]) * (a & 4 ? x[2] : 1 - x[2]);
  return out;
}

std::array<Eigen::Vector3d, 8> trilinear_slopes(const Eigen::Vector3d& x) {
  std::array<Eigen::Vector3d, 8> out;
  for (int a = 0; a < 8; ++a) {
    const double wx = a & 1 ? x[0] : 1 - x[0], wy = a & 2 ? x[1] : 1 - x[1],
                 wz = a & 4 ? x[2] : 1 - x[2];
    out[a] = {(a & 1 ? 1 : -1) * wy * wz, wx * (a & 2 ? 1 : -1) * wz, wx * wy * (a & 4 ? 1 : -1)};
  }
  return out;
}

CellMetric::CellMetric(const Eigen::Matrix3d& index_to_world)
    : volume(std::abs(index_to_world.determinant())) {
  const Eigen::Matrix3d inverse = index_to_world.inverse();
  metric = inverse * inverse.transpose();
  // Zeros of an orthogonal grid, but for rounding.
  for (int p = 0; p < 3; ++p)
    for (int q = 0; q < 3; ++q)
      if (std::abs(metric(p, q)) < 1e-12 * std::sqrt(metric(p, p) * metric(q, q))) metric(p, q) = 0;
}

CellMatrix cell_mass(const Moments& moments) {
  const Integrals integrals(moments);
  CellMatrix out;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b <= a; ++b)
      out(a, b) = out(b, a) = mass_entry(integrals, corner(a), corner(b));
  return out;
}

CellMatrix cell_matrix(const Moments& moments, const CellMetric& metric, double mass,
                       double stiffness) {
  const Integrals integrals(moments);
  CellMatrix out;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b <= a; ++b) {
      double sum = mass * mass_entry(integrals, corner(a), corner(b));
      for (int p = 0; p < 3; ++p)
        for (int q = 0; q < 3; ++q)
          if (metric.metric(p, q) != 0)
            sum += stiffness * metric.metric(p, q) *
                   slope_entry(integrals, corner(a), corner(b), p, q);
      out(a, b) = out(b, a) = metric.volume * sum;
    }
  return out;
}

}  // namespace surf::fem
