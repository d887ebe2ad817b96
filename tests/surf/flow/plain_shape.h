// A shape that moves without a mesh library, and an energy with a known minimum.
#pragma once

#include "libsurf/energy/boundary_integral.h"
#include "libsurf/flow/evolution.h"
#include "libsurf/flow/moving_shape.h"
#include "tests/surf/fixtures.h"

namespace surf::test {

/// A shape whose mesh never changes; what it refuses is set by the test.
template <int Dim>
class PlainShape : public flow::MovingShape<Dim> {
 public:
  explicit PlainShape(const Arrays<Dim>& arrays) : shape_(arrays.X, arrays.T) {}

  fem::Geometry<Dim> geometry() const override { return shape_; }
  double max_displacement() const override { return longest; }
  double restrict_move(Points<Dim>& to) override {
    if (!is_frozen) return 0;
    to = shape_.points();
    return 1;
  }
  void move_to(const Points<Dim>& to) override { shape_ = shape_.moved_to(to); }
  bool mend() override { return false; }
  std::string obstacle() const override {
    return shape_.radius() < smallest_radius ? "the object vanished" : "";
  }

  double longest = 0.1;
  double smallest_radius = 0;
  bool is_frozen = false;

 private:
  fem::Geometry<Dim> shape_;
};

/// H = (|x|^2 - 1)^2 + 0.2: a valley along the unit sphere; the weighted area is minimal on a
/// sphere just inside.
template <int Dim>
class SphericalValley : public Field<Dim> {
 public:
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<Dim> p = x.row(i);
      const double q = p.squaredNorm() - 1;
      out.value[i] = 0.2 + q * q;
      if (order >= Derivatives::kFirst) out.gradient.row(i) = 4 * q * p;
      if (order < Derivatives::kSecond) continue;
      const Eigen::Matrix<double, Dim, Dim> h =
          8 * p * p.transpose() + 4 * q * Eigen::Matrix<double, Dim, Dim>::Identity();
      out.hessian.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, Dim * Dim>>(h.data());
    }
  }
};

template <int Dim>
energy::BoundaryIntegral<Dim> valley_energy() {
  return energy::BoundaryIntegral<Dim>(std::make_shared<const SphericalValley<Dim>>());
}

template <int Dim>
Arrays<Dim> start() {
  auto arrays = random_smooth_shape<Dim>(1, Dim == 2 ? 3 : 2);
  arrays.X *= 1.2;
  return arrays;
}

/// Each step lowers J, downhill, and moves no vertex further than `longest`.
inline void expect_descent(const flow::FlowSummary& summary, double longest) {
  double before = summary.initial_energy;
  for (const flow::StepRecord& step : summary.steps) {
    EXPECT_LT(step.energy, before);
    EXPECT_LE(step.shape_derivative, 0);
    EXPECT_LE(step.max_displacement_mm, longest * (1 + 1e-12));
    before = step.energy;
  }
  EXPECT_EQ(summary.final_energy, before);
}

}  // namespace surf::test
