#include "libsurf/volume/detail/smoother.h"

#include <cmath>
#include <cstddef>

#include "libsurf/volume/detail/tile_store.h"

namespace surf::volume {
namespace {

constexpr double kSigmaPerNode = 0.7;        // of the Gaussian, in spacings of the field's grid
constexpr int kMostVoxels = 8;               // per node and axis: a tile reads the cube of it
constexpr double kSplineVariance = 1.0 / 3;  // of the cubic B-spline, in spacings squared
constexpr int kTile = 16;                    // nodes per tile of means and axis

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

/// A triangle as wide as two distances of nodes, {1} for 1: of a step it makes a blur whose
/// variance does not depend on where it lies between the nodes (a mean over one distance: 16 to 38
/// voxels^2 in place of 27 at 8 voxels). What is left of a Gaussian of 0.7 nodes is no less than 0
/// up to 7 voxels; at 8 the variance is 0.4 % more than it should be.
Kernel triangle_kernel(int factor) {
  Kernel half(factor);
  for (int d = 0; d < factor; ++d) half[d] = double(factor - d) / (double(factor) * factor);
  return half;
}

double variance_of(const Kernel& half) {
  double sum = 0;
  for (std::size_t d = 1; d < half.size(); ++d) sum += 2 * half[d] * double(d * d);
  return sum;
}

/// Convolves along one axis with a symmetric kernel and keeps every `factor`-th value, those at
/// lower <= index < upper of the coarser grid; `in` covers what they need.
ValueBox convolved(const ValueBox& in, int axis, const Kernel& half, int factor, int lower,
                   int upper) {
  const int radius = static_cast<int>(half.size()) - 1;
  Index3 out_lower = in.lower, out_upper = in.upper();
  out_lower[axis] = lower;
  out_upper[axis] = upper;
  ValueBox out(out_lower, out_upper);
  const std::size_t step = in.stride(axis);
  const float* first = in.values.data() + (factor * lower - in.lower[axis]) * step;
  const std::size_t along = axis == 0 ? factor : 1;  // from one value of a row to the next
  const auto across = [&](int other) { return in.stride(other) * (other == axis ? factor : 1); };
  std::size_t to = 0;
  std::vector<double> sums(out.size[0]);
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j) {
      const float* centre = first + k * across(2) + j * across(1);
      for (int i = 0; i < out.size[0]; ++i) sums[i] = half[0] * centre[i * along];
      for (int d = 1; d <= radius; ++d)
        for (int i = 0; i < out.size[0]; ++i)
          sums[i] +=
              half[d] * (double(centre[i * along - d * step]) + centre[i * along + d * step]);
      for (int i = 0; i < out.size[0]; ++i) out.values[to++] = static_cast<float>(sums[i]);
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
  const auto continue_row = [&](float* first) {  // first: the value at `lower`
    for (int index = lower; index < upper; ++index) {
      if (index >= 0 && index < size) continue;
      const bool is_before = index < 0;
      const std::ptrdiff_t inwards = is_before ? step : -step;
      const float* end = first + ((is_before ? 0 : size - 1) - lower) * step;
      const double beyond = is_before ? -index : index - (size - 1);
      double sum = 0;  // of differences, so that constants stay the same to the bit
      for (int k = 1; k < n; ++k)
        sum +=
            (1.0 / n - (k - mean) * (beyond + mean) / squares) * (double(end[k * inwards]) - *end);
      first[(index - lower) * step] = static_cast<float>(*end + sum);
    }
  };
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  for (int i = 0; i < box.size[a]; ++i)
    for (int j = 0; j < box.size[b]; ++j)
      continue_row(box.values.data() + i * box.stride(a) + j * box.stride(b));
}

/// How many values at an end continue a box beyond it, where a kernel reaches so far.
int n_of_lines(int radius) { return 2 + radius / 2; }

}  // namespace

/// Weighted means of the voxels round each node after the selective Gaussian blur; the voxels
/// themselves where each is a node.
class NodeMeans {
 public:
  NodeMeans(const Volume& volume, const Index3& factor, const Index3& size,
            const std::array<Kernel, 3>& selective, double threshold)
      : volume_(volume),
        factor_(factor),
        size_(size),
        selective_(selective),
        threshold_(static_cast<float>(threshold)),
        is_coarse_(factor != Index3{1, 1, 1}) {
    std::size_t n = 1;
    for (int axis = 0; axis < 3; ++axis) {
      triangle_[axis] = triangle_kernel(factor[axis]);
      n_tiles_[axis] = (size[axis] + kTile - 1) / kTile;
      n *= std::size_t(n_tiles_[axis]);
    }
    if (is_coarse_) tiles_ = std::make_unique<TileStore>(n, std::size_t(kTile) * kTile * kTile);
  }

  /// Beyond the grid as at its nearest node.
  ValueBox box(const Index3& lower, const Index3& upper) const {
    if (!is_coarse_) return selected(lower, upper);
    ValueBox out(lower, upper);
    std::size_t to = 0;
    for (int k = lower[2]; k < upper[2]; ++k)
      for (int j = lower[1]; j < upper[1]; ++j) {
        const int row_j = std::clamp(j, 0, size_[1] - 1), row_k = std::clamp(k, 0, size_[2] - 1);
        const float* row = nullptr;
        int of_tile = -1;
        for (int i = lower[0]; i < upper[0]; ++i) {
          const int at = std::clamp(i, 0, size_[0] - 1);
          if (at / kTile != of_tile) {
            of_tile = at / kTile;
            row = tile({of_tile, row_j / kTile, row_k / kTile}) +
                  (row_k % kTile * kTile + row_j % kTile) * kTile;
          }
          out.values[to++] = row[at % kTile];
        }
      }
    return out;
  }

 private:
  const float* tile(const Index3& at) const {
    return tiles_->tile((std::size_t(at[2]) * n_tiles_[1] + at[1]) * n_tiles_[0] + at[0],
                        [&](float* out) {
                          Index3 lower, upper;
                          for (int axis = 0; axis < 3; ++axis) {
                            lower[axis] = at[axis] * kTile;
                            upper[axis] = std::min(lower[axis] + kTile, size_[axis]);
                          }
                          const ValueBox means = averaged(lower, upper);
                          const float* row = means.values.data();
                          for (int k = 0; k < means.size[2]; ++k)
                            for (int j = 0; j < means.size[1]; ++j, row += means.size[0])
                              std::copy(row, row + means.size[0], out + (k * kTile + j) * kTile);
                        });
  }

  ValueBox averaged(const Index3& lower, const Index3& upper) const {
    const Index3 radius = radii(triangle_);
    Index3 first, end, n_lines;  // voxels
    for (int axis = 0; axis < 3; ++axis) {
      n_lines[axis] = n_of_lines(2 * factor_[axis]);
      const int last = volume_.size()[axis];
      first[axis] = std::min(factor_[axis] * lower[axis] - radius[axis], last - n_lines[axis]);
      end[axis] = std::max(factor_[axis] * (upper[axis] - 1) + radius[axis] + 1, n_lines[axis]);
    }
    ValueBox values = selected(first, end);
    if (is_constant(values)) {
      ValueBox same(lower, upper);
      std::fill(same.values.begin(), same.values.end(), values.values.front());
      return same;
    }
    for (int axis = 0; axis < 3; ++axis)
      continue_lines(values, axis, volume_.size()[axis], n_lines[axis]);
    for (int axis = 2; axis >= 0; --axis)
      values = convolved(values, axis, triangle_[axis], factor_[axis], lower[axis], upper[axis]);
    return values;
  }

  /// Intensities after the selective Gaussian blur; beyond the volume as at its nearest voxel.
  ValueBox selected(const Index3& lower, const Index3& upper) const {
    const Index3 radius = radii(selective_);
    ValueBox raw(widened(lower, radius, -1), widened(upper, radius, 1));
    volume_.copy_box(raw.lower, raw.upper(), raw.values.data());
    if (radius == Index3{0, 0, 0}) return raw;
    ValueBox out(lower, upper);
    std::size_t to = 0;
    for (int k = 0; k < out.size[2]; ++k)
      for (int j = 0; j < out.size[1]; ++j)
        for (int i = 0; i < out.size[0]; ++i)
          out.values[to++] =
              selective_mean(raw, i + radius[0], j + radius[1], k + radius[2], radius);
    return out;
  }

  float selective_mean(const ValueBox& raw, int i, int j, int k, const Index3& radius) const {
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

  Volume volume_;
  Index3 factor_, size_, n_tiles_;
  std::array<Kernel, 3> triangle_, selective_;
  float threshold_;
  bool is_coarse_;
  std::unique_ptr<TileStore> tiles_;
};

Smoother::Smoother(const Volume& volume, const SmoothingOptions& options) {
  const auto sigma = sigma_in_voxels(volume, options.sigma_mm);
  const auto selective_sigma = sigma_in_voxels(volume, options.selective_sigma_mm);
  Index3 factor;
  Eigen::Vector3d scale;
  std::array<Kernel, 3> selective;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.size()[axis] - 1;
    const int n = factor[axis] = std::clamp(static_cast<int>(sigma[axis] / kSigmaPerNode + 1e-9), 1,
                                            std::min(last, kMostVoxels));
    grid_.size[axis] = (last + n - 1) / n + 1;
    scale[axis] = n;
    kernel_[axis] =
        n == 1
            ? gaussian_kernel(sigma[axis])
            : discrete_gaussian_kernel((sigma[axis] * sigma[axis] - (n * n - 1) * kSplineVariance -
                                        variance_of(triangle_kernel(n))) /
                                       (n * n));
    selective[axis] = selective_kernel(selective_sigma[axis]);
  }
  grid_.index_to_world = volume.index_to_world() * Eigen::Scaling(scale);
  means_ = std::make_unique<NodeMeans>(volume, factor, grid_.size, selective,
                                       options.selective_threshold);
}

Smoother::~Smoother() = default;

ValueBox Smoother::box(const Index3& lower, const Index3& upper) const {
  const Index3 radius = radii(kernel_);
  ValueBox values = means_->box(widened(lower, radius, -1), widened(upper, radius, 1));
  for (int axis = 0; axis < 3; ++axis)
    continue_lines(values, axis, grid_.size[axis], n_of_lines(radius[axis]));
  if (is_constant(values)) {  // background, masked air, clean phantoms: nothing to smooth
    ValueBox same(lower, upper);
    std::fill(same.values.begin(), same.values.end(), values.values.front());
    return same;
  }
  for (int axis = 2; axis >= 0; --axis)
    values = convolved(values, axis, kernel_[axis], 1, lower[axis], upper[axis]);
  return values;
}

}  // namespace surf::volume
