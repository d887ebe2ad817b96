#include "libsurf/volume/image_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

using Index3 = std::array<int, 3>;

/// A box of float values, i fastest.
struct Box {
  Index3 lower, upper;
  std::vector<float> values;

  Box(const Index3& low, const Index3& high) : lower(low), upper(high) {
    values.resize(std::size_t(extent(0)) * extent(1) * extent(2));
  }
  int extent(int axis) const { return upper[axis] - lower[axis]; }
  std::size_t stride(int axis) const {
    return axis == 0 ? 1 : axis == 1 ? extent(0) : std::size_t(extent(0)) * extent(1);
  }
};

Index3 widened(Index3 index, const Index3& by, int sign) {
  for (int axis = 0; axis < 3; ++axis) index[axis] += sign * by[axis];
  return index;
}

/// Half of a symmetric kernel, centre first.
using Kernel = std::vector<double>;

/// Gaussian of this deviation [voxels], truncated at 3 sigma, sum of the whole kernel 1.
Kernel gaussian_kernel(double sigma) {
  Kernel half(1 + static_cast<int>(std::ceil(3 * sigma)), 1.0);
  double sum = 1;
  for (std::size_t d = 1; d < half.size(); ++d) {
    half[d] = std::exp(-0.5 * d * d / (sigma * sigma));
    sum += 2 * half[d];
  }
  for (double& weight : half) weight /= sum;
  return half;
}

/// Standard deviations along the index axes of a Gaussian of sigma_mm in the world: exact for
/// orthogonal axes; for a sheared grid the diagonal of the covariance in index space.
std::array<double, 3> sigma_in_voxels(const Volume& volume, double sigma_mm) {
  std::array<double, 3> sigma;
  for (int axis = 0; axis < 3; ++axis)
    sigma[axis] = sigma_mm * volume.world_to_index().linear().row(axis).norm();
  return sigma;
}

/// Convolves along one axis; the result is narrower by the kernel's radius on both sides.
Box convolved(const Box& in, int axis, const Kernel& half) {
  const int radius = static_cast<int>(half.size()) - 1;
  if (radius == 0) return in;
  Index3 by = {0, 0, 0};
  by[axis] = radius;
  Box out(widened(in.lower, by, 1), widened(in.upper, by, -1));
  const std::size_t step = in.stride(axis);
  std::size_t to = 0;
  std::vector<double> sums(out.extent(0));
  for (int k = 0; k < out.extent(2); ++k)
    for (int j = 0; j < out.extent(1); ++j) {
      const float* centre = in.values.data() + k * in.stride(2) + j * in.stride(1) + radius * step;
      for (int i = 0; i < out.extent(0); ++i) sums[i] = half[0] * centre[i];
      for (int d = 1; d <= radius; ++d)
        for (int i = 0; i < out.extent(0); ++i)
          sums[i] += half[d] * (double(centre[i - d * step]) + centre[i + d * step]);
      for (int i = 0; i < out.extent(0); ++i) out.values[to++] = static_cast<float>(sums[i]);
    }
  return out;
}

bool is_constant(const Box& box) {
  return std::all_of(box.values.begin(), box.values.end(),
                     [&](float value) { return value == box.values.front(); });
}

/// Smoothed intensities of a volume on any box of voxels.
class Smoother {
 public:
  Smoother(Volume volume, const SmoothingOptions& options)
      : volume_(std::move(volume)), threshold_(static_cast<float>(options.selective_threshold)) {
    const auto sigma = sigma_in_voxels(volume_, options.sigma_mm);
    const auto selective = sigma_in_voxels(volume_, options.selective_sigma_mm);
    for (int axis = 0; axis < 3; ++axis) {
      kernel_[axis] = gaussian_kernel(std::max(sigma[axis], 1e-12));
      if (options.sigma_mm == 0) kernel_[axis] = {1.0};
      selective_[axis] = gaussian_kernel(std::max(selective[axis], 1e-12));
      selective_[axis].resize(1 + static_cast<int>(std::ceil(2 * selective[axis])));
      if (options.selective_sigma_mm == 0) selective_[axis] = {1.0};
    }
  }

  Box box(const Index3& lower, const Index3& upper) const {
    const Index3 radius = radii(kernel_);
    Box values = selected(widened(lower, radius, -1), widened(upper, radius, 1));
    if (is_constant(values)) {  // background, masked air, clean phantoms: nothing to smooth
      Box same(lower, upper);
      std::fill(same.values.begin(), same.values.end(), values.values.front());
      return same;
    }
    for (int axis = 2; axis >= 0; --axis) values = convolved(values, axis, kernel_[axis]);
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
    volume_.copy_box(raw.lower, raw.upper, raw.values.data());
    if (radius == Index3{0, 0, 0}) return raw;
    Box out(lower, upper);
    std::size_t to = 0;
    for (int k = 0; k < out.extent(2); ++k)
      for (int j = 0; j < out.extent(1); ++j)
        for (int i = 0; i < out.extent(0); ++i)
          out.values[to++] =
              selective_mean(raw, i + radius[0], j + radius[1], k + radius[2], radius);
    return out;
  }

  float selective_mean(const Box& raw, int i, int j, int k, const Index3& radius) const {
    const float* centre = raw.values.data() + k * raw.stride(2) + j * raw.stride(1) + i;
    double sum = 0, weights = 0;
    for (int c = -radius[2]; c <= radius[2]; ++c)
      for (int b = -radius[1]; b <= radius[1]; ++b)
        for (int a = -radius[0]; a <= radius[0]; ++a) {
          const float value =
              centre[std::ptrdiff_t(c) * raw.stride(2) + std::ptrdiff_t(b) * raw.stride(1) + a];
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
};

/// First difference along `axis` at `at`, averaged across by (side, centre, side) weights.
double difference(const Box& box, const float* at, int axis, double side, double centre) {
  const auto step = static_cast<std::ptrdiff_t>(box.stride(axis));
  const auto b = static_cast<std::ptrdiff_t>(box.stride((axis + 1) % 3));
  const auto c = static_cast<std::ptrdiff_t>(box.stride((axis + 2) % 3));
  const auto d = [&](std::ptrdiff_t shift) {
    return (double(at[shift + step]) - at[shift - step]) / 2;
  };
  return centre * centre * d(0) + centre * side * (d(b) + d(-b) + d(c) + d(-c)) +
         side * side * (d(b + c) + d(b - c) + d(c - b) + d(-b - c));
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
      volume, [smoother](const Index3& lower, const Index3& upper, float* out) {
        const Box box = smoother->box(lower, upper);
        std::copy(box.values.begin(), box.values.end(), out);
      });
}

std::shared_ptr<const TiledField> edge_indicator(const Volume& volume,
                                                 const SmoothingOptions& smoothing, double lambda,
                                                 DerivativeFilter filter) {
  if (const std::string error = smoothing.error(); !error.empty()) throw UsageError(error);
  if (!(lambda > 0) || !std::isfinite(lambda))
    throw UsageError(fmt::format("edge_indicator: lambda = {} violates > 0", lambda));
  const auto smoother = std::make_shared<const Smoother>(volume, smoothing);
  const Eigen::Matrix3d index_from_world = volume.world_to_index().linear();
  const double side = filter == DerivativeFilter::kScharr ? 3.0 / 16 : 1.0 / 6;
  const double centre = 1 - 2 * side;
  return std::make_shared<const TiledField>(
      volume, [=](const Index3& lower, const Index3& upper, float* out) {
        const Box box = smoother->box(widened(lower, {1, 1, 1}, -1), widened(upper, {1, 1, 1}, 1));
        if (is_constant(box)) {
          const std::size_t n =
              std::size_t(box.extent(0) - 2) * (box.extent(1) - 2) * (box.extent(2) - 2);
          std::fill(out, out + n, 1.0f);
          return;
        }
        for (int k = 1; k < box.extent(2) - 1; ++k)
          for (int j = 1; j < box.extent(1) - 1; ++j)
            for (int i = 1; i < box.extent(0) - 1; ++i) {
              const float* at =
                  box.values.data() + k * box.stride(2) + j * box.stride(1) + std::size_t(i);
              const Eigen::Vector3d index_gradient(difference(box, at, 0, side, centre),
                                                   difference(box, at, 1, side, centre),
                                                   difference(box, at, 2, side, centre));
              const double squared = (index_from_world.transpose() * index_gradient).squaredNorm();
              *out++ = static_cast<float>(1 / (1 + squared / (lambda * lambda)));
            }
      });
}

}  // namespace surf::volume
