// Images in the plane and volumes from functions, as fields: for tests of what works on both.
#pragma once

#include <algorithm>
#include <functional>
#include <random>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/base/rounding_step.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/node_box.h"

namespace surf::test {

/// Values at the cells, blurred by about 0.7 cells (1/4, 2/4, 1/4 along each axis); they and their
/// central differences are linear in between.
template <int Dim>
class LatticeImage : public Field<Dim> {
 public:
  using Affine = Eigen::Transform<double, Dim, Eigen::Affine>;

  LatticeImage(const std::array<int, Dim>& size, const Affine& index_to_world,
               std::vector<float> values)
      : extent_{{size, index_to_world, index_to_world.inverse()}, {}}, values_(std::move(values)) {
    box_.size = size;
    const auto [lowest, highest] = std::minmax_element(values_.begin(), values_.end());
    extent_.range = extent_.usual = {*lowest, *highest};
    extent_.rounded_to = rounding_step(values_, std::size_t(size[0]));
    for (int axis = 0; axis < Dim; ++axis) {
      const std::vector<float> before = values_;
      box_.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
        values_[at] = before[at] / 2 + (neighbour(before, at, here, stride, axis, -1) +
                                        neighbour(before, at, here, stride, axis, 1)) /
                                           4;
      });
    }
    for (int axis = 0; axis < Dim; ++axis) {
      differences_[axis].resize(values_.size());
      box_.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
        differences_[axis][at] = (neighbour(values_, at, here, stride, axis, 1) -
                                  neighbour(values_, at, here, stride, axis, -1)) /
                                 2;
      });
    }
  }

  const segment::ImageExtent<Dim>& extent() const { return extent_; }

  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Vector<Dim> index = extent_.world_to_index * x.row(i).transpose();
      out.value[i] = interpolated(values_, index);
      if (order < Derivatives::kFirst) continue;
      Vector<Dim> along;
      for (int axis = 0; axis < Dim; ++axis) along[axis] = interpolated(differences_[axis], index);
      out.gradient.row(i) = (extent_.world_to_index.linear().transpose() * along).transpose();
    }
  }

 private:
  float neighbour(const std::vector<float>& values, std::size_t at, int here, std::size_t stride,
                  int axis, int step) const {
    const int there = std::clamp(here + step, 0, box_.size[axis] - 1);
    return values[at + (std::ptrdiff_t(there) - here) * std::ptrdiff_t(stride)];
  }

  double interpolated(const std::vector<float>& values, const Vector<Dim>& index) const {
    double out = 0;
    for (int corner = 0; corner < 1 << Dim; ++corner) {
      std::array<int, Dim> node;
      double weight = 1;
      for (int axis = 0; axis < Dim; ++axis) {
        const double x = std::clamp(index[axis], 0.0, box_.size[axis] - 1.0);
        const int first = std::min(int(x), box_.size[axis] - 2), bit = corner >> axis & 1;
        node[axis] = first + bit;
        weight *= bit ? x - first : 1 - x + first;
      }
      out += weight * values[box_.at(node)];
    }
    return out;
  }

  segment::ImageExtent<Dim> extent_;
  segment::NodeBox<Dim> box_;
  std::vector<float> values_;
  std::array<std::vector<float>, Dim> differences_;
};

/// Cells with the values of a function of the index, and Gaussian noise.
template <int Dim>
LatticeImage<Dim> image_of(const std::function<double(const Vector<Dim>&)>& value, double noise,
                           int size = 48,
                           const Eigen::Transform<double, Dim, Eigen::Affine>& index_to_world =
                               Eigen::Transform<double, Dim, Eigen::Affine>::Identity()) {
  const auto box = segment::NodeBox<Dim>::cube(0, size);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<float> values;
  for (std::size_t at = 0; at < box.n(); ++at) {
    Vector<Dim> index;
    for (int axis = 0; axis < Dim; ++axis) index[axis] = box.node(at)[axis];
    values.push_back(float(value(index) + noise * normal(random)));
  }
  return {box.size, index_to_world, std::move(values)};
}

}  // namespace surf::test
