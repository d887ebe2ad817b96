// Fields by formula for tests in the plane.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>

#include "libsurf/base/field.h"

namespace surf::curve {

/// A function and its gradient.
class FormulaField : public Field<2> {
 public:
  using Value = std::function<double(const Vector<2>&)>;
  using Gradient = std::function<Vector<2>(const Vector<2>&)>;
  FormulaField(Value value, Gradient gradient)
      : value_(std::move(value)), gradient_(std::move(gradient)) {}

  void sample(const Points<2>& x, Derivatives order, Samples<2>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      out.value[i] = value_(x.row(i));
      if (order >= Derivatives::kFirst) out.gradient.row(i) = gradient_(x.row(i));
    }
    out.hessian.setZero();
  }

 private:
  Value value_;
  Gradient gradient_;
};

/// Bright round the origin, with waves all over.
inline std::shared_ptr<const Field<2>> bright_waves() {
  return std::make_shared<FormulaField>(
      [](const Vector<2>& x) {
        return std::exp(-x.squaredNorm()) + 0.2 * std::sin(3 * x[0] + x[1]);
      },
      [](const Vector<2>& x) {
        const double e = std::exp(-x.squaredNorm()), c = 0.2 * std::cos(3 * x[0] + x[1]);
        return Vector<2>(-2 * x[0] * e + 3 * c, -2 * x[1] * e + c);
      });
}

/// A Neumann problem with a known solution: u_i = a_i cos(pi x) cos(pi y) + b_i has no normal
/// derivative on the squares |x|, |y| <= 1 and 2, nor has any other, with the image
/// I_i = (1 + 2 pi^2 mu) a_i cos cos + b_i; i = 1 inside the smaller square.
struct TwoSquares {
  static constexpr double kMu = 0.05;
  static constexpr std::array<double, 2> kA = {-0.3, 1.0}, kB = {0.2, -0.5};  // outside, inside
  static constexpr double kPi = std::numbers::pi, kFactor = 1 + 2 * kPi * kPi * kMu;

  static bool is_inside(const Vector<2>& x) { return x.cwiseAbs().maxCoeff() < 1; }
  static double exact(const Vector<2>& x, bool inside) {
    return kA[inside] * std::cos(kPi * x[0]) * std::cos(kPi * x[1]) + kB[inside];
  }
  static Vector<2> exact_gradient(const Vector<2>& x, bool inside) {
    return -kPi * kA[inside] *
           Vector<2>(std::sin(kPi * x[0]) * std::cos(kPi * x[1]),
                     std::cos(kPi * x[0]) * std::sin(kPi * x[1]));
  }
  static std::shared_ptr<const Field<2>> image() {
    return std::make_shared<FormulaField>(
        [](const Vector<2>& x) {
          const bool inside = is_inside(x);
          return kFactor * (exact(x, inside) - kB[inside]) + kB[inside];
        },
        [](const Vector<2>& x) { return Vector<2>(kFactor * exact_gradient(x, is_inside(x))); });
  }
};

/// The corners of [-half, half]^2.
inline Points<2> square(double half) {
  Points<2> out(4, 2);
  out << -half, -half, half, -half, half, half, -half, half;
  return out;
}

}  // namespace surf::curve
