#include "libsurf/segment/detail/node_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "libsurf/volume/detail/spline.h"

namespace surf::segment {
namespace {

using volume::SplineWeights;

/// The four nodes round a coordinate along one axis, those beyond the grid moved to its border.
struct Stencil {
  SplineWeights weights;
  std::array<std::size_t, 4> offset;

  SURF_INLINE Stencil(double u, int size, std::size_t stride, Derivatives order)
      : weights(fraction(u, size), order) {
    const int base = int(std::floor(limited(u, size)));
    for (int s = 0; s < 4; ++s)
      offset[s] = stride * std::size_t(std::clamp(base - 1 + s, 0, size - 1));
  }

 private:
  SURF_INLINE static double limited(double u, int size) { return std::clamp(u, -3.0, size + 2.0); }
  SURF_INLINE static double fraction(double u, int size) {
    const double inside = limited(u, size);
    return inside - std::floor(inside);
  }
};

/// The four nodes round a place along each axis.
template <int Dim>
struct Stencils {
  std::array<SplineWeights, Dim> weights;
  std::array<std::array<std::size_t, 4>, Dim> offset;
  bool is_inside;  // the four nodes of a row lie side by side

  SURF_INLINE Stencils(const Vector<Dim>& node, const std::array<int, Dim>& size, Derivatives order)
      : Stencils(along(node, size, order)) {}

 private:
  SURF_INLINE explicit Stencils(const std::array<Stencil, Dim>& along)
      : weights(weights_of(along)) {
    for (int axis = 0; axis < Dim; ++axis) offset[axis] = along[axis].offset;
    is_inside = offset[0][3] == offset[0][0] + 3;
  }
  SURF_INLINE static std::array<SplineWeights, Dim> weights_of(
      const std::array<Stencil, Dim>& along) {
    if constexpr (Dim == 2)
      return {along[0].weights, along[1].weights};
    else
      return {along[0].weights, along[1].weights, along[2].weights};
  }
  SURF_INLINE static std::array<Stencil, Dim> along(const Vector<Dim>& node,
                                                    const std::array<int, Dim>& size,
                                                    Derivatives order) {
    const Stencil i(node[0], size[0], 1, order), j(node[1], size[1], std::size_t(size[0]), order);
    if constexpr (Dim == 2)
      return {i, j};
    else
      return {i, j, Stencil(node[2], size[2], std::size_t(size[0]) * size[1], order)};
  }
};

/// The rows of a field's values that stencils name.
template <int Dim>
struct RowsOfField {
  const Stencils<Dim>& stencils;
  const float* values;

  SURF_INLINE volume::SplineRow operator()(int j, int k) const {
    const float* line = values + stencils.offset[1][std::size_t(j)];
    if constexpr (Dim == 3) line += stencils.offset[2][std::size_t(k)];
    const auto& offset = stencils.offset[0];
    if (stencils.is_inside) return volume::row_of(line + offset[0]);
    return volume::SplineRow{line[offset[0]], line[offset[1]], line[offset[2]], line[offset[3]]};
  }
};

constexpr std::size_t kLines = 16;  // that are filtered side by side

/// Three boxes of 2 r + 1 nodes along `width` neighbouring lines of `n` nodes `stride` apart.
void box_filters(float* line, int n, std::size_t stride, std::size_t width, int r) {
  std::vector<double> sums((std::size_t(n) + 1) * width);
  const double scale = 1.0 / (2 * r + 1);
  for (int round = 0; round < 3; ++round) {
    std::fill_n(sums.begin(), width, 0.0);
    for (int i = 0; i < n; ++i) {
      const float* from = line + std::size_t(i) * stride;
      const double* before = sums.data() + std::size_t(i) * width;
      double* to = sums.data() + std::size_t(i + 1) * width;
      for (std::size_t k = 0; k < width; ++k) to[k] = before[k] + from[k];
    }
    for (int i = 0; i < n; ++i) {
      const double* high = sums.data() + std::size_t(std::min(i + r, n - 1) + 1) * width;
      const double* low = sums.data() + std::size_t(std::max(i - r, 0)) * width;
      float* to = line + std::size_t(i) * stride;
      for (std::size_t k = 0; k < width; ++k) to[k] = float(scale * (high[k] - low[k]));
    }
  }
}

/// Lines along the first axis, which are turned so that they too lie side by side.
void blur_rows(std::vector<float>& values, int n, int r) {
  const std::size_t n_rows = values.size() / std::size_t(n),
                    n_parts = (n_rows + kLines - 1) / kLines;
  tbb::parallel_for(std::size_t(0), n_parts, [&](std::size_t part) {
    const std::size_t width = std::min(kLines, n_rows - part * kLines);
    float* rows = values.data() + part * kLines * std::size_t(n);
    std::vector<float> turned(std::size_t(n) * width);
    for (std::size_t k = 0; k < width; ++k)
      for (int i = 0; i < n; ++i) turned[std::size_t(i) * width + k] = rows[k * std::size_t(n) + i];
    box_filters(turned.data(), n, width, width, r);
    for (std::size_t k = 0; k < width; ++k)
      for (int i = 0; i < n; ++i) rows[k * std::size_t(n) + i] = turned[std::size_t(i) * width + k];
  });
}

}  // namespace

template <int Dim>
Points<Dim> NodeGrid<Dim>::positions(std::size_t first, std::size_t end) const {
  Points<Dim> out(Eigen::Index(end - first), Dim);
  for (std::size_t at = first; at < end; ++at) {
    Vector<Dim> node;
    std::size_t rest = at;
    for (int axis = 0; axis < Dim; rest /= std::size_t(size[axis]), ++axis)
      node[axis] = double(rest % std::size_t(size[axis]));
    out.row(Eigen::Index(at - first)) = (node_to_world * node).transpose();
  }
  return out;
}

template <int Dim, std::size_t N>
NodeFields<Dim, N>::NodeFields(const NodeGrid<Dim>& grid, std::array<std::vector<float>, N> values)
    : grid_(grid), world_to_node_(grid.node_to_world.inverse()), values_(std::move(values)) {}

template <int Dim, std::size_t N>
SURF_INLINE std::array<PointSample<Dim>, N> NodeFields<Dim, N>::sample_once(
    const Vector<Dim>& x, Derivatives order) const {
  const Eigen::Matrix<double, Dim, Dim> to_nodes = world_to_node_.linear();
  const Stencils<Dim> stencils(world_to_node_ * x, grid_.size, order);
  std::array<PointSample<Dim>, N> out;
  for (std::size_t n = 0; n < N; ++n) {
    const volume::SplineSums<Dim> sums(stencils.weights, order,
                                       RowsOfField<Dim>{stencils, values_[n].data()});
    out[n].value = sums.value;
    if (order == Derivatives::kNone) continue;
    out[n].gradient = to_nodes.transpose() * sums.gradient;
    if (order == Derivatives::kFirst) continue;
    out[n].hessian = to_nodes.transpose() * sums.hessian * to_nodes;
  }
  return out;
}

template <int Dim, std::size_t N>
SURF_AVX2 std::array<PointSample<Dim>, N> NodeFields<Dim, N>::sample_by_avx2(
    const Vector<Dim>& x, Derivatives order) const {
  return sample_once(x, order);
}

template <int Dim, std::size_t N>
std::array<PointSample<Dim>, N> NodeFields<Dim, N>::sample(const Vector<Dim>& x,
                                                           Derivatives order) const {
  return volume::has_avx2() ? sample_by_avx2(x, order) : sample_once(x, order);
}

void blur(const std::array<int, 3>& size, double deviation, std::vector<float>& values) {
  blur(size, deviation, {{}, size}, values);
}

void blur(const std::array<int, 3>& size, double deviation, const IndexBox<3>& wanted,
          std::vector<float>& values) {
  // Three boxes of radius r have variance r (r + 1).
  const int r = std::max(0, int(std::lround((std::sqrt(1 + 4 * deviation * deviation) - 1) / 2)));
  if (r == 0 || wanted.n() == 0) return;
  // Of the lines along an axis those that are wanted along the axes before it.
  if (size[0] > 1) blur_rows(values, size[0], r);
  const auto filter = [&](int axis, const IndexBox<3>& first_nodes) {
    if (size[axis] == 1) return;
    const std::size_t stride = IndexBox<3>{{}, size}.stride(axis);
    const std::size_t n_parts = (std::size_t(first_nodes.size[0]) + kLines - 1) / kLines,
                      n_rows = first_nodes.n() / std::size_t(first_nodes.size[0]);
    tbb::parallel_for(std::size_t(0), n_rows * n_parts, [&](std::size_t task) {
      const std::size_t along_row = task % n_parts * kLines,
                        row = task / n_parts * std::size_t(first_nodes.size[0]);
      const std::size_t first = IndexBox<3>{{}, size}.at(first_nodes.node(row + along_row));
      box_filters(values.data() + first, size[axis], stride,
                  std::min(kLines, std::size_t(first_nodes.size[0]) - along_row), r);
    });
  };
  const auto& lower = wanted.lower;
  filter(1, {{lower[0], 0, 0}, {wanted.size[0], 1, size[2]}});
  filter(2, {{lower[0], lower[1], 0}, {wanted.size[0], wanted.size[1], 1}});
}

template struct NodeGrid<2>;
template struct NodeGrid<3>;
template class NodeFields<2, 1>;
template class NodeFields<3, 1>;
template class NodeFields<2, 3>;
template class NodeFields<3, 3>;

}  // namespace surf::segment
