#include "libsurf/volume/image_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"
#include "libsurf/volume/detail/spline.h"

namespace surf::volume {
namespace {

using Index3 = std::array<int, 3>;

/// A box of float values, i fastest.
struct Box : IndexBox<3> {
  std::vector<float> values;

  Box(const Index3& low, const Index3& high) : IndexBox<3>(between(low, high)), values(n()) {}
};

Index3 widened(Index3 index, const Index3& by, int sign) {
  for (int axis = 0; axis < 3; ++axis) index[axis] += sign * by[axis];
  return index;
}

constexpr double kSigmaPerNode = 0.7;        // of the Gaussian, in spacings of the field's grid
constexpr int kMostVoxels = 4;               // per node and axis: a tile reads the cube of it
constexpr double kSplineVariance = 1.0 / 3;  // of the cubic B-spline, in spacings squared

/// Standard deviations along the index axes of a Gaussian of sigma_mm in the world: exact for
/// orthogonal axes; for a sheared grid the diagonal of the covariance in index space.
std::array<double, 3> sigma_in_voxels(const Volume& volume, double sigma_mm) {
  std::array<double, 3> sigma;
  for (int axis = 0; axis < 3; ++axis)
    sigma[axis] = sigma_mm * volume.world_to_index().linear().row(axis).norm();
  return sigma;
}

/// Convolves along one axis with a symmetric kernel and keeps every `factor`-th value, those at
/// lower <= index < upper of the coarser grid; `in` covers what they need.
Box convolved(const Box& in, int axis, const Kernel& half, int factor, int lower, int upper) {
  const int radius = static_cast<int>(half.size()) - 1;
  Index3 out_lower = in.lower, out_upper = in.upper();
  out_lower[axis] = lower;
  out_upper[axis] = upper;
  Box out(out_lower, out_upper);
  const std::size_t step = in.stride(axis);
  const std::size_t along = axis == 0 ? factor : 1;  // from one value of a row to the next
  const auto across = [&](int other) { return in.stride(other) * (other == axis ? factor : 1); };
  std::size_t to = 0;
  std::vector<double> sums(out.size[0]);
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j) {
      const float* centre = in.values.data() + k * across(2) + j * across(1) + radius * step;
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
void continue_lines(Box& box, int axis, int size, int n) {
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

bool is_constant(const Box& box) {
  return std::all_of(box.values.begin(), box.values.end(),
                     [&](float value) { return value == box.values.front(); });
}

/// Smoothed intensities of a volume on any box of its grid, which is that of the voxels or, where
/// the Gaussian is wide, one of every factor-th voxel along an axis.
class Smoother {
 public:
  Smoother(Volume volume, const SmoothingOptions& options)
      : volume_(std::move(volume)), threshold_(static_cast<float>(options.selective_threshold)) {
    auto sigma = sigma_in_voxels(volume_, options.sigma_mm);
    Eigen::Vector3d scale;
    for (int axis = 0; axis < 3; ++axis) {
      const int last = volume_.size()[axis] - 1;
      factor_[axis] = std::clamp(static_cast<int>(sigma[axis] / kSigmaPerNode + 1e-9), 1,
                                 std::min(last, kMostVoxels));
      grid_.size[axis] = (last + factor_[axis] - 1) / factor_[axis] + 1;
      scale[axis] = factor_[axis];
      // The wider spline takes over a part of the Gaussian's variance.
      sigma[axis] = std::sqrt(sigma[axis] * sigma[axis] -
                              (factor_[axis] * factor_[axis] - 1) * kSplineVariance);
    }
    grid_.index_to_world = volume_.index_to_world() * Eigen::Scaling(scale);
    const auto selective = sigma_in_voxels(volume_, options.selective_sigma_mm);
    for (int axis = 0; axis < 3; ++axis) {
      kernel_[axis] = gaussian_kernel(sigma[axis]);
      selective_[axis] = selective_kernel(selective[axis]);
    }
  }

  const Grid& grid() const { return grid_; }

  Box box(const Index3& lower, const Index3& upper) const {
    const Index3 radius = radii(kernel_);
    Index3 first, end;  // voxels
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = factor_[axis] * lower[axis] - radius[axis];
      end[axis] = factor_[axis] * (upper[axis] - 1) + radius[axis] + 1;
    }
    Box values = selected(first, end);
    for (int axis = 0; axis < 3; ++axis)
      continue_lines(values, axis, volume_.size()[axis], 2 + radius[axis] / 2);
    if (is_constant(values)) {  // background, masked air, clean phantoms: nothing to smooth
      Box same(lower, upper);
      std::fill(same.values.begin(), same.values.end(), values.values.front());
      return same;
    }
    for (int axis = 2; axis >= 0; --axis)
      values = convolved(values, axis, kernel_[axis], factor_[axis], lower[axis], upper[axis]);
    return values;
  }

 private:
  static Index3 radii(const std::array<Kernel, 3>& kernel) {
    return {int(kernel[0].size()) - 1, int(kernel[1].size()) - 1, int(kernel[2].size()) - 1};
  }

  /// Intensities after the selective Gaussian blur.
  Box selected(const Index3& lower, const Index3& upper) const {
    const Index3 radius = radii(selective_);
    Box raw(widened(lower, radius, -1), widened(upper, radius, 1));
    volume_.copy_box(raw.lower, raw.upper(), raw.values.data());
    if (radius == Index3{0, 0, 0}) return raw;
    Box out(lower, upper);
    std::size_t to = 0;
    for (int k = 0; k < out.size[2]; ++k)
      for (int j = 0; j < out.size[1]; ++j)
        for (int i = 0; i < out.size[0]; ++i)
          out.values[to++] =
              selective_mean(raw, i + radius[0], j + radius[1], k + radius[2], radius);
    return out;
  }

  float selective_mean(const Box& raw, int i, int j, int k, const Index3& radius) const {
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
  float threshold_;
  std::array<Kernel, 3> kernel_, selective_;
  Index3 factor_;  // voxels per node of the grid
  Grid grid_;
};

/// Three weights (-1, 0, 1) applied along one axis; the result is narrower by one on both sides.
Box filtered(const Box& in, int axis, const std::array<float, 3>& weights) {
  Index3 by = {0, 0, 0};
  by[axis] = 1;
  Box out(widened(in.lower, by, 1), widened(in.upper(), by, -1));
  const std::size_t step = in.stride(axis);
  float* to = out.values.data();
  for (int k = 0; k < out.size[2]; ++k)
    for (int j = 0; j < out.size[1]; ++j, to += out.size[0]) {
      const float* from = in.values.data() + k * in.stride(2) + j * in.stride(1);
      for (int i = 0; i < out.size[0]; ++i)
        to[i] =
            weights[0] * from[i] + weights[1] * from[i + step] + weights[2] * from[i + 2 * step];
    }
  return out;
}

/// Differences along the index axes, each averaged across by (side, centre, side): 0.4 of the time
/// of 27 weights at each node.
std::array<Box, 3> index_gradient(const Box& box, DerivativeFilter filter) {
  const auto side = static_cast<float>(side_weight(filter));
  const std::array<float, 3> mean = {side, 1 - 2 * side, side}, difference = {-0.5f, 0, 0.5f};
  const Box mean_z = filtered(box, 2, mean);
  const Box mean_yz = filtered(mean_z, 1, mean);
  return {filtered(mean_yz, 0, difference), filtered(filtered(mean_z, 1, difference), 0, mean),
          filtered(filtered(filtered(box, 2, difference), 1, mean), 0, mean)};
}

}  // namespace

std::string SmoothingOptions::error() const {
  if (!(sigma_mm >= 0))
    return fmt::format("SmoothingOptions::sigma_mm = {} violates >= 0", sigma_mm);
  if (!(selective_sigma_mm >= 0))
    return fmt::format("SmoothingOptions::selective_sigma_mm = {} violates >= 0",
                       selective_sigma_mm);
  if (selective_sigma_mm > 0 && !(selective_threshold > 0))
    return fmt::format(
        "SmoothingOptions::selective_threshold = {} violates > 0 where a selective blur is asked "
        "for",
        selective_threshold);
  return {};
}

std::shared_ptr<const TiledField> intensity_field(const Volume& volume,
                                                  const SmoothingOptions& smoothing) {
  if (const std::string error = smoothing.error(); !error.empty()) throw UsageError(error);
  const auto smoother = std::make_shared<const Smoother>(volume, smoothing);
  return std::make_shared<const TiledField>(
      smoother->grid(), [smoother](const Index3& lower, const Index3& upper, float* out) {
        const Box box = smoother->box(lower, upper);
        std::copy(box.values.begin(), box.values.end(), out);
      });
}

Grid field_grid(const Volume& volume, const SmoothingOptions& smoothing) {
  if (const std::string error = smoothing.error(); !error.empty()) throw UsageError(error);
  return Smoother(volume, smoothing).grid();
}

std::shared_ptr<const TiledField> edge_indicator(const Volume& volume,
                                                 const SmoothingOptions& smoothing, double lambda,
                                                 DerivativeFilter filter) {
  if (const std::string error = smoothing.error(); !error.empty()) throw UsageError(error);
  if (!(lambda > 0) || !std::isfinite(lambda))
    throw UsageError(fmt::format("edge_indicator: lambda = {} violates > 0", lambda));
  const auto smoother = std::make_shared<const Smoother>(volume, smoothing);
  // Gradients in units of lambda.
  const Eigen::Matrix3d scaled = smoother->grid().index_to_world.linear().inverse() / lambda;
  return std::make_shared<const TiledField>(smoother->grid(), [=](const Index3& lower,
                                                                  const Index3& upper, float* out) {
    const Box box = smoother->box(widened(lower, {1, 1, 1}, -1), widened(upper, {1, 1, 1}, 1));
    if (is_constant(box)) {
      const std::size_t n = std::size_t(box.size[0] - 2) * (box.size[1] - 2) * (box.size[2] - 2);
      std::fill(out, out + n, 1.0f);
      return;
    }
    const std::array<Box, 3> gradient = index_gradient(box, filter);
    for (std::size_t at = 0; at < gradient[0].values.size(); ++at) {
      const Eigen::Vector3d along(gradient[0].values[at], gradient[1].values[at],
                                  gradient[2].values[at]);
      const double squared = (scaled.transpose() * along).squaredNorm();
      out[at] = static_cast<float>(1 / (1 + squared));
    }
  });
}

}  // namespace surf::volume
