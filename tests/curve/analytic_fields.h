// Fields by formula for tests in the plane.
#pragma once

#include <functional>

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

/// The corners of [-half, half]^2.
inline Points<2> square(double half) {
  Points<2> out(4, 2);
  out << -half, -half, half, -half, half, half, -half, half;
  return out;
}

}  // namespace surf::curve
