// Scalar fields on R^Dim: image intensities, edge indicators, analytic functions.
#pragma once

#include "libsurf/base/types.h"

namespace surf {

/// How far a field is to be differentiated.
enum class Derivatives { kNone = 0, kFirst = 1, kSecond = 2 };

/// Values, and as many derivatives as were asked for, at n points.
template <int Dim>
struct Samples {
  Eigen::VectorXd value;  ///< (n)
  Points<Dim> gradient;   ///< (n, Dim) [1/mm], world frame; empty unless asked for
  Eigen::Matrix<double, Eigen::Dynamic, Dim * Dim, Eigen::RowMajor>
      hessian;  ///< (n, Dim*Dim) [1/mm^2], symmetric; empty unless asked for

  void resize(Eigen::Index n, Derivatives order) {
    value.resize(n);
    gradient.resize(order >= Derivatives::kFirst ? n : 0, Dim);
    hessian.resize(order >= Derivatives::kSecond ? n : 0, Dim * Dim);
  }
};

/// A scalar field. Value, gradient and Hessian are those of one function, so that shape
/// derivatives are derivatives of the energy that is evaluated. Thread-safe.
template <int Dim>
class Field {
 public:
  virtual ~Field() = default;
  /// Samples at the points x (n, Dim) [mm]; out is resized.
  virtual void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const = 0;
};

}  // namespace surf
