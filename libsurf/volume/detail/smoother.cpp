#include "libsurf/volume/detail/smoother.h"

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <span>

namespace surf::volume {
namespace {

constexpr double kSigmaPerNode = 0.7;  // of the Gaussian, in spacings of the field's grid
// Of a narrower Gaussian, which is applied first, whose nodes have no more than 4 voxels between
// them [voxels]; and from how many times as wide a one on. Of one as wide as 15 voxels each tile
// would smooth a hundred times the voxels that it has.
constexpr double kNarrower = 3.6, kVeryWide = 2;
constexpr int kMostVoxels = 4;               // per node and axis: a tile reads the cube of it
constexpr double kSplineVariance = 1.0 / 3;  // of the cubic B-spline, in spacings squared
constexpr int kTile = 16;                    // nodes per tile and axis
constexpr int kLayer = 8;                    // voxels, as a leaf of the volume has
// Nodes beyond the grid that are made: a spline asks for two, H for three; further ones are as the
// last of them.
constexpr int kBeyond = 3;

Index3 radii(const std::array<Kernel, 3>& kernel) {
  return {int(kernel[0].size()) - 1, int(kernel[1].size()) - 1, int(kernel[2].size()) - 1};
}

/// Standard deviations along the index axes of a Gaussian of sigma_mm in the world: exact for
/// orthogonal axes; for a sheared grid the diagonal of the covariance in index space.
std::array<double, 3> sigma_in_voxels(const Volume& volume, double sigma_mm) {
  std::array<double, 3> sigma;
  for (int axis = 0; axis < 3; ++axis)
    sigma[axis] = sigma_mm * volume.world_to_index().linear().row(axis).norm();
  return sigma;
}

/// N values that lie side by side. Of differences, so that constants stay the same to the bit.
template <int N>
void convolve(const float* centre, std::ptrdiff_t step, std::span<const float> half, float* out) {
  using Block = Eigen::Array<float, N, 1>;
  const Block here = Eigen::Map<const Block>(centre);
  Block sum = Block::Zero();
  for (std::ptrdiff_t d = 1; d < std::ssize(half); ++d)
    sum += half[std::size_t(d)] * ((Eigen::Map<const Block>(centre - d * step) - here) +
                                   (Eigen::Map<const Block>(centre + d * step) - here));
  Eigen::Map<Block> result(out);
  result = here + sum;
}

/// Convolves along one axis with a symmetric kernel and keeps every `factor`-th value, those at
/// lower <= index < upper of the coarser grid; `in` covers what they need.
ValueBox convolved(const ValueBox& in, int axis, const Kernel& half, int factor, int lower,
                   int upper) {
  constexpr int kBlock = 16;
  const std::vector<float> weights(half.begin(), half.end());
  Index3 out_lower = in.lower, out_upper = in.upper();
  out_lower[axis] = lower;
  out_upper[axis] = upper;
  ValueBox out(out_lower, out_upper);
  const std::ptrdiff_t step = std::ptrdiff_t(in.stride(axis));
  const float* first = in.values.data() + (factor * lower - in.lower[axis]) * step;
  const std::ptrdiff_t along = axis == 0 ? factor : 1;  // from one value of a row to the next
  const auto across = [&](int other) { return in.stride(other) * (other == axis ? factor : 1); };
  float* to = out.values.data();
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j, to += out.size[0]) {
      const float* centre = first + k * across(2) + j * across(1);
      const bool has_blocks = along == 1 && out.size[0] >= kBlock;
      for (int i = 0; i < out.size[0]; i += has_blocks ? kBlock : 1)
        if (has_blocks) {  // the last one may have a part of that before it once more
          i = std::min(i, out.size[0] - kBlock);
          convolve<kBlock>(centre + i, step, weights, to + i);
        } else {
          convolve<1>(centre + i * along, step, weights, to + i);
        }
    }
  return out;
}

/// Replaces what lies outside 0 <= index < size along one axis by the lines of least squares
/// through the n values at each end: a blur then leaves a linear function as it is, and an edge
/// that meets the border obliquely where it is. (Copies of the last value bend it: 0.2 voxels
/// outwards at a ball of radius 15 cut off 6 voxels beyond its centre, 0.5 under a blur of 1.5
/// voxels.)
void continue_lines(ValueBox& box, int axis, int size, int n) {
  const int lower = box.lower[axis], upper = box.upper()[axis];
  if (lower >= 0 && upper <= size) return;
  n = std::min({n, size, upper, size - lower});
  if (n < 2) return;
  const double mean = (n - 1) / 2.0, squares = n * (double(n) * n - 1) / 12;
  const std::ptrdiff_t step = std::ptrdiff_t(box.stride(axis));
  const int inner = axis == 0 ? 1 : 0, outer = 3 - axis - inner;
  const std::ptrdiff_t across = std::ptrdiff_t(box.stride(inner));
  const int n_across = box.size[inner];
  std::vector<float> sums(n_across);  // of differences, so that constants stay the same to the bit
  const auto continue_to = [&](int index, int end, std::ptrdiff_t inwards) {
    for (int i = 0; i < box.size[outer]; ++i) {
      float* first = box.values.data() + i * box.stride(outer);
      const float* from = first + (end - lower) * step;
      std::fill(sums.begin(), sums.end(), 0.0f);
      for (int k = 1; k < n; ++k) {
        const float weight = float(1.0 / n - (k - mean) * (std::abs(index - end) + mean) / squares);
        const float* other = from + k * inwards;
        for (int j = 0; j < n_across; ++j)
          sums[j] += weight * (other[j * across] - from[j * across]);
      }
      float* to = first + (index - lower) * step;
      for (int j = 0; j < n_across; ++j) to[j * across] = from[j * across] + sums[j];
    }
  };
  for (int index = lower; index < 0; ++index) continue_to(index, 0, step);
  for (int index = size; index < upper; ++index) continue_to(index, size - 1, -step);
}

}  // namespace

Smoother::Smoother(const Volume& volume, const SmoothingOptions& options)
    : Smoother(volume, options, Nodes::kOfASpline) {}

Smoother::Smoother(const Volume& volume, const SmoothingOptions& options, Nodes nodes)
    : volume_(volume),
      size_(volume.size()),
      threshold_(static_cast<float>(options.selective_threshold)) {
  const auto sigma = sigma_in_voxels(volume_, options.sigma_mm);
  const auto selective = sigma_in_voxels(volume_, options.selective_sigma_mm);
  const double widest = *std::max_element(sigma.begin(), sigma.end());
  if (nodes == Nodes::kOfASpline && widest >= kVeryWide * kNarrower) {
    SmoothingOptions narrower = options;
    narrower.sigma_mm *= kNarrower / widest;
    narrower_.reset(new Smoother(volume, narrower, Nodes::kOfAnotherGaussian));
    size_ = narrower_->grid_.size;
  }
  Eigen::Vector3d scale;
  std::size_t n_tiles = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = narrower_ ? narrower_->factor_[axis] : 1;  // [voxels]
    const double done = narrower_ ? narrower_->variance_[axis] : 0;
    const double per_node = nodes == Nodes::kOfASpline
                                ? sigma[axis] / side / kSigmaPerNode
                                : std::sqrt((sigma[axis] * sigma[axis] + kSplineVariance) /
                                            (kSigmaPerNode * kSigmaPerNode + kSplineVariance));
    const int last = size_[axis] - 1;
    factor_[axis] = std::clamp(static_cast<int>(per_node + 1e-9), 1, std::min(last, kMostVoxels));
    grid_.size[axis] = (last + factor_[axis] - 1) / factor_[axis] + 1;
    scale[axis] = factor_[axis];
    // The wider spline takes over a part of the Gaussian's variance.
    const double spacing = factor_[axis] * side;
    variance_[axis] = sigma[axis] * sigma[axis] - done - (spacing * spacing - 1) * kSplineVariance;
    kernel_[axis] = gaussian_kernel(std::sqrt(variance_[axis]) / side);
    selective_[axis] = selective_kernel(selective[axis]);
    n_tiles_[axis] = grid_.size[axis] / kTile + 3;  // one before it
    n_tiles *= std::size_t(n_tiles_[axis]);
  }
  grid_.index_to_world = (narrower_ ? narrower_->grid_.index_to_world : volume_.index_to_world()) *
                         Eigen::Scaling(scale);
  if (narrower_ || factor_ != Index3{1, 1, 1})
    tiles_ = std::make_unique<TileStore>(n_tiles, std::size_t(kTile) * kTile * kTile);
}

Smoother::~Smoother() = default;

std::size_t Smoother::memory_bytes() const {
  return (tiles_ ? tiles_->memory_bytes() : 0) + (narrower_ ? narrower_->memory_bytes() : 0);
}

ValueBox Smoother::box(const Index3& lower, const Index3& upper) const {
  if (!tiles_) return smoothed(lower, upper);
  ValueBox out(lower, upper);
  const auto within = [&](int node, int axis) {  // counted from the first tile on
    return std::clamp(node, -kBeyond, grid_.size[axis] - 1 + kBeyond) + kTile;
  };
  std::size_t to = 0;
  for (int k = lower[2]; k < upper[2]; ++k)
    for (int j = lower[1]; j < upper[1]; ++j) {
      const int at_j = within(j, 1), at_k = within(k, 2);
      const float* row = nullptr;
      int of_tile = -1;
      for (int i = lower[0]; i < upper[0]; ++i) {
        const int at_i = within(i, 0);
        if (at_i / kTile != of_tile) {
          of_tile = at_i / kTile;
          row = tile({of_tile, at_j / kTile, at_k / kTile}) +
                (at_k % kTile * kTile + at_j % kTile) * kTile;
        }
        out.values[to++] = row[at_i % kTile];
      }
    }
  return out;
}

const float* Smoother::tile(const Index3& at) const {
  const auto fill = [&](float* out) {
    IndexBox<3> whole = IndexBox<3>::cube(0, kTile);
    Index3 lower, upper;
    for (int axis = 0; axis < 3; ++axis) {
      whole.lower[axis] = (at[axis] - 1) * kTile;
      lower[axis] = std::max(whole.lower[axis], -kBeyond);
      upper[axis] = std::min(whole.lower[axis] + kTile, grid_.size[axis] + kBeyond);
    }
    const ValueBox values = smoothed(lower, upper);
    const float* row = values.values.data();
    for (int k = lower[2]; k < upper[2]; ++k)
      for (int j = lower[1]; j < upper[1]; ++j, row += values.size[0])
        std::copy(row, row + values.size[0], out + whole.at({lower[0], j, k}));
  };
  return tiles_->tile((std::size_t(at[2]) * n_tiles_[1] + at[1]) * n_tiles_[0] + at[0], fill);
}

ValueBox Smoother::smoothed(const Index3& lower, const Index3& upper) const {
  const Index3 radius = radii(kernel_);
  Index3 first, end, n_of_lines;  // voxels
  for (int axis = 0; axis < 3; ++axis) {
    const int size = size_[axis];
    n_of_lines[axis] = 2 + radius[axis] / 2;
    first[axis] = std::min(factor_[axis] * lower[axis] - radius[axis], size - n_of_lines[axis]);
    end[axis] = std::max(factor_[axis] * (upper[axis] - 1) + radius[axis] + 1, n_of_lines[axis]);
  }
  const auto along = [&](const ValueBox& in, int axis) {
    if (!is_constant(in))
      return convolved(in, axis, kernel_[axis], factor_[axis], lower[axis], upper[axis]);
    ValueBox same = in;  // background, masked air, clean phantoms: nothing to smooth
    same.lower[axis] = lower[axis];
    same.size[axis] = upper[axis] - lower[axis];
    same.values.resize(same.n(), in.values.front());
    return same;
  };
  // Layer by layer of leaves, which stays in the cache until two of its axes are done.
  ValueBox values({lower[0], lower[1], first[2]}, {upper[0], upper[1], end[2]});
  auto to = values.values.begin();
  for (int k = first[2], next = 0; k < end[2]; k = next) {
    next = std::min(end[2], k < 0 ? 0 : (k / kLayer + 1) * kLayer);
    ValueBox layer = selected({first[0], first[1], k}, {end[0], end[1], next});
    for (int axis = 0; axis < 2; ++axis) continue_lines(layer, axis, size_[axis], n_of_lines[axis]);
    layer = along(along(layer, 1), 0);
    to = std::copy(layer.values.begin(), layer.values.end(), to);
  }
  continue_lines(values, 2, size_[2], n_of_lines[2]);
  return along(values, 2);
}

ValueBox Smoother::selected(const Index3& lower, const Index3& upper) const {
  if (narrower_) return narrower_->box(lower, upper);
  const Index3 radius = radii(selective_);
  ValueBox raw(widened(lower, radius, -1), widened(upper, radius, 1));
  volume_.copy_box(raw.lower, raw.upper(), raw.values.data());
  if (radius == Index3{0, 0, 0}) return raw;
  ValueBox out(lower, upper);
  std::size_t to = 0;
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j)
      for (int i = 0; i < out.size[0]; ++i)
        out.values[to++] = selective_mean(raw, i + radius[0], j + radius[1], k + radius[2], radius);
  return out;
}

float Smoother::selective_mean(const ValueBox& raw, int i, int j, int k,
                               const Index3& radius) const {
  const auto row = std::ptrdiff_t(raw.stride(1)), slice = std::ptrdiff_t(raw.stride(2));
  const float* centre = raw.values.data() + k * slice + j * row + i;
  double sum = 0, weights = 0;
  for (int c = -radius[2]; c <= radius[2]; ++c)
    for (int b = -radius[1]; b <= radius[1]; ++b)
      for (int a = -radius[0]; a <= radius[0]; ++a) {
        const float value = centre[c * slice + b * row + a];
        if (std::abs(value - *centre) > threshold_) continue;
        const double weight =
            selective_[0][std::abs(a)] * selective_[1][std::abs(b)] * selective_[2][std::abs(c)];
        sum += weight * value;
        weights += weight;
      }
  return static_cast<float>(sum / weights);
}

}  // namespace surf::volume
