#include "libsurf/segment/node_field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "libsurf/volume/detail/spline.h"

namespace surf::segment {
namespace {

using volume::SplineWeights;

constexpr Eigen::Index kBlock = 1024;  // points that one thread takes at once

/// The four nodes round a coordinate along one axis, those beyond the grid moved to its border.
struct Stencil {
  SplineWeights weights;
  std::array<std::size_t, 4> offset;

  Stencil(double u, int size, std::size_t stride) : weights(fraction(u, size)) {
    const int base = int(std::floor(limited(u, size)));
    for (int s = 0; s < 4; ++s)
      offset[s] = stride * std::size_t(std::clamp(base - 1 + s, 0, size - 1));
  }

 private:
  static double limited(double u, int size) { return std::clamp(u, -3.0, size + 2.0); }
  static double fraction(double u, int size) {
    const double inside = limited(u, size);
    return inside - std::floor(inside);
  }
};

/// Sums of the values by the weights of each axis, differentiated up to some order: entries of the
/// lower axes are shared, which is three times as fast as one sum for each derivative.
template <int Dim>
class Sums {
 public:
  Sums(const std::vector<float>& values, const std::array<Stencil, Dim>& stencils, int order)
      : values_(values.data()), stencils_(stencils), order_(order) {
    if constexpr (Dim == 2)
      plane(0, planes_);
    else
      volume();
  }

  /// Differentiated `orders[axis]` times along each axis.
  double operator()(const std::array<int, Dim>& orders) const {
    if constexpr (Dim == 2)
      return planes_[orders[0]][orders[1]];
    else
      return volumes_[orders[0]][orders[1]][orders[2]];
  }

 private:
  using Plane = std::array<std::array<double, 3>, 3>;

  const std::array<double, 4>& weights(int axis, int order) const {
    const SplineWeights& w = stencils_[axis].weights;
    return order == 0 ? w.value : order == 1 ? w.first : w.second;
  }

  void plane(std::size_t offset, Plane& out) const {
    std::array<std::array<double, 4>, 3> rows;
    for (int b = 0; b < 4; ++b) {
      const float* line = values_ + offset + stencils_[1].offset[b];
      std::array<double, 4> v;
      for (int a = 0; a < 4; ++a) v[a] = double(line[stencils_[0].offset[a]]);
      for (int i = 0; i <= order_; ++i) {
        const std::array<double, 4>& w = weights(0, i);
        double row = 0;
        for (int a = 0; a < 4; ++a) row += w[a] * v[a];
        rows[i][b] = row;
      }
    }
    for (int i = 0; i <= order_; ++i)
      for (int j = 0; i + j <= order_; ++j) {
        const std::array<double, 4>& w = weights(1, j);
        double sum = 0;
        for (int b = 0; b < 4; ++b) sum += w[b] * rows[i][b];
        out[i][j] = sum;
      }
  }

  void volume() {
    std::array<Plane, 4> planes;
    for (int c = 0; c < 4; ++c) plane(stencils_[2].offset[c], planes[c]);
    for (int i = 0; i <= order_; ++i)
      for (int j = 0; i + j <= order_; ++j)
        for (int k = 0; i + j + k <= order_; ++k) {
          const std::array<double, 4>& w = weights(2, k);
          double sum = 0;
          for (int c = 0; c < 4; ++c) sum += w[c] * planes[c][i][j];
          volumes_[i][j][k] = sum;
        }
  }

  const float* values_;
  const std::array<Stencil, Dim>& stencils_;
  int order_;
  Plane planes_ = {};
  std::array<Plane, 3> volumes_ = {};
};

template <int Dim>
std::array<Stencil, Dim> stencils_at(const Vector<Dim>& node, const std::array<int, Dim>& size) {
  const Stencil i(node[0], size[0], 1), j(node[1], size[1], std::size_t(size[0]));
  if constexpr (Dim == 2)
    return {i, j};
  else
    return {i, j, Stencil(node[2], size[2], std::size_t(size[0]) * size[1])};
}

/// One box of 2 r + 1 nodes along lines of `n` nodes that lie `stride` apart.
void box_filter(float* line, int n, std::size_t stride, int r, std::vector<double>& sums) {
  sums[0] = 0;
  for (int i = 0; i < n; ++i) sums[i + 1] = sums[i] + line[i * stride];
  const double scale = 1.0 / (2 * r + 1);
  for (int i = 0; i < n; ++i)
    line[i * stride] = float(scale * (sums[std::min(i + r, n - 1) + 1] - sums[std::max(i - r, 0)]));
}

}  // namespace

template <int Dim>
Points<Dim> NodeGrid<Dim>::positions() const {
  Points<Dim> out(Eigen::Index(n()), Dim);
  for (Eigen::Index at = 0; at < out.rows(); ++at) {
    Vector<Dim> node;
    Eigen::Index rest = at;
    for (int axis = 0; axis < Dim; rest /= size[axis], ++axis)
      node[axis] = double(rest % size[axis]);
    out.row(at) = (node_to_world * node).transpose();
  }
  return out;
}

template <int Dim>
NodeField<Dim>::NodeField(const NodeGrid<Dim>& grid, std::vector<float> values)
    : grid_(grid), world_to_node_(grid.node_to_world.inverse()), values_(std::move(values)) {}

template <int Dim>
void NodeField<Dim>::sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const {
  out.resize(x.rows(), order);
  const Eigen::Matrix<double, Dim, Dim> to_nodes = world_to_node_.linear();
  const int n_orders = order == Derivatives::kNone ? 0 : order == Derivatives::kFirst ? 1 : 2;
  const auto sample_one = [&](Eigen::Index at) {
    const auto stencils =
        stencils_at<Dim>(world_to_node_ * Vector<Dim>(x.row(at).transpose()), grid_.size);
    const Sums<Dim> sums(values_, stencils, n_orders);
    std::array<int, Dim> orders{};
    out.value[at] = sums(orders);
    if (n_orders == 0) return;
    Vector<Dim> gradient;
    for (int a = 0; a < Dim; ++a) {
      orders = {};
      orders[a] = 1;
      gradient[a] = sums(orders);
    }
    out.gradient.row(at) = (to_nodes.transpose() * gradient).transpose();
    if (n_orders == 1) return;
    Eigen::Matrix<double, Dim, Dim> hessian;
    for (int a = 0; a < Dim; ++a)
      for (int b = a; b < Dim; ++b) {
        orders = {};
        ++orders[a];
        ++orders[b];
        hessian(a, b) = hessian(b, a) = sums(orders);
      }
    Eigen::Map<Eigen::Matrix<double, Dim, Dim>>(out.hessian.row(at).data()) =
        to_nodes.transpose() * hessian * to_nodes;
  };
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, x.rows(), kBlock), [&](const auto& range) {
    for (Eigen::Index at = range.begin(); at < range.end(); ++at) sample_one(at);
  });
}

void blur(const std::array<int, 3>& size, double deviation, std::vector<float>& values) {
  // Three boxes of radius r have variance r (r + 1).
  const int r = std::max(0, int(std::lround((std::sqrt(1 + 4 * deviation * deviation) - 1) / 2)));
  if (r == 0) return;
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; stride *= size[axis], ++axis) {
    if (size[axis] == 1) continue;
    std::vector<double> sums(std::size_t(size[axis]) + 1);
    const std::size_t block = stride * size[axis];
    for (std::size_t begin = 0; begin < values.size(); begin += block)
      for (std::size_t line = begin; line < begin + stride; ++line)
        for (int round = 0; round < 3; ++round)
          box_filter(values.data() + line, size[axis], stride, r, sums);
  }
}

template struct NodeGrid<2>;
template struct NodeGrid<3>;
template class NodeField<2>;
template class NodeField<3>;

}  // namespace surf::segment
