// A ball in a volume, as a formula that counts how often it is asked.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>

#include "libsurf/base/field.h"
#include "libsurf/segment/search_grid.h"

namespace surf::test {

constexpr int kBallFieldSize = 100;

/// A bright ball in 100^3 voxels of 1 mm, and a wave of small amplitude everywhere.
class BallField : public Field<3> {
 public:
  BallField(const Vector<3>& center, double radius) : center_(center), radius_(radius) {}

  static segment::ImageExtent<3> extent() {
    segment::ImageExtent<3> out{{{kBallFieldSize, kBallFieldSize, kBallFieldSize},
                                 Eigen::Affine3d::Identity(),
                                 Eigen::Affine3d::Identity()},
                                {}};
    out.range = out.usual = {-0.1f, 1.1f};
    return out;
  }
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<3> off = x.row(i).transpose() - center_;
      const double r = std::max(off.norm(), 1e-12), share = 1 / (1 + std::exp(r - radius_));
      const Vector<3> phase = 2.1 * x.row(i).transpose();
      out.value[i] = share + 0.03 * phase.array().sin().prod();
      if (order < Derivatives::kFirst) continue;
      Vector<3> wave;
      for (int axis = 0; axis < 3; ++axis)
        wave[axis] = 0.03 * 2.1 * std::cos(phase[axis]) * std::sin(phase[(axis + 1) % 3]) *
                     std::sin(phase[(axis + 2) % 3]);
      out.gradient.row(i) = (wave - share * (1 - share) / r * off).transpose();
    }
    n_asked_ += std::size_t(x.rows());
  }
  /// Points, so far.
  std::size_t n_asked() const { return n_asked_; }

 private:
  Vector<3> center_;
  double radius_;
  mutable std::atomic<std::size_t> n_asked_ = 0;
};

/// Its nodes are the voxels.
inline segment::SearchLattice<3> ball_lattice() { return {BallField::extent(), 1.5e6}; }

}  // namespace surf::test
