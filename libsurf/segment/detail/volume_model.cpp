#include "libsurf/segment/detail/volume_model.h"

#include <cmath>

#include "libsurf/base/rounding_step.h"
#include "libsurf/base/usual_range.h"
#include "libsurf/energy/mumford_shah.h"
#include "libsurf/segment/contrast.h"
#include "libsurf/segment/detail/some_values.h"

namespace surf::segment {
namespace {

constexpr double kMostSamples = 1 << 22;  // of the voxels, for their two classes
constexpr int kRows = 12;                 // along either axis, in which rounding is seen

/// Of rows that are spread over it.
double rounding_step_of(const volume::Volume& volume) {
  const auto& size = volume.size();
  std::vector<float> rows(std::size_t(kRows) * kRows * size[0]);
  for (int m = 0; m < kRows; ++m)
    for (int n = 0; n < kRows; ++n) {
      const int j = (2 * n + 1) * size[1] / (2 * kRows), k = (2 * m + 1) * size[2] / (2 * kRows);
      volume.copy_box({0, j, k}, {size[0], j + 1, k + 1},
                      rows.data() + (std::size_t(m) * kRows + n) * size[0]);
    }
  return rounding_step(rows, std::size_t(size[0]));
}

}  // namespace

ImageExtent<3> extent_of(const volume::Volume& volume) {
  ImageExtent<3> out{{volume.size(), volume.index_to_world(), volume.world_to_index()},
                     volume.range(),
                     rounding_step_of(volume)};
  out.usual = usual_range(out.range, some_values<3>(out.size, reader_of(volume)));
  return out;
}

ImageModel::ImageModel(const volume::Volume& volume, const ImageExtent<3>& extent,
                       const volume::SmoothingOptions& smoothing, volume::DerivativeFilter filter)
    : EnergyModel<3>(extent),
      volume_(volume),
      smoothed_(volume, smoothing),
      filter_(filter),
      intensity_(smoothed_.intensity()) {}

std::shared_ptr<const Field<3>> ImageModel::make_edge_indicator(double lambda) const {
  edge_indicators_.push_back(smoothed_.edge_indicator(lambda, filter_));
  return edge_indicators_.back();
}

std::size_t ImageModel::memory_bytes() const {
  std::size_t out = smoothed_.memory_bytes() + intensity_->memory_bytes();
  for (const auto& field : edge_indicators_) out += field->memory_bytes();
  if (integral_) out += integral_->memory_bytes();
  return out;
}

std::optional<energy::Antiderivative<3>> ImageModel::antiderivative() const {
  const volume::Grid& grid = smoothed_.grid();
  if (double(grid.size[0]) * grid.size[1] * grid.size[2] > kMostIntegrated) return {};
  if (!integral_) integral_ = smoothed_.intensity_integral();
  const auto axes = grid.index_to_world.linear();
  const double spacing_mm = std::min(axes.col(1).norm(), axes.col(2).norm());
  return energy::Antiderivative<3>{axes.col(0), integral_, spacing_mm};
}

/// One pass over the voxels, needed by the outer mean only.
energy::ImageTotals ImageModel::sum_up() const {
  const auto& size = volume_.size();
  std::vector<float> slice(std::size_t(size[0]) * size[1]);
  double sum = 0, squares = 0;
  for (int k = 0; k < size[2]; ++k) {
    volume_.copy_box({0, 0, k}, {size[0], size[1], k + 1}, slice.data());
    for (const float value : slice) {
      sum += value;
      squares += double(value) * value;
    }
  }
  const double voxel = std::pow(volume_.voxel_size(), 3);
  return {voxel * double(volume_.n_voxels()), voxel * sum, voxel * squares};
}

/// From every n-th voxel along each axis where there are many.
double ImageModel::contrast(const SeedModel& seed) const {
  const auto& size = volume_.size();
  const int stride =
      static_cast<int>(std::ceil(std::cbrt(double(volume_.n_voxels()) / kMostSamples)));
  std::vector<float> slice(std::size_t(size[0]) * size[1]), values;
  for (int k = 0; k < size[2]; k += stride) {
    volume_.copy_box({0, 0, k}, {size[0], size[1], k + 1}, slice.data());
    for (int j = 0; j < size[1]; j += stride)
      for (int i = 0; i < size[0]; i += stride)
        values.push_back(slice[std::size_t(j) * size[0] + i]);
  }
  return two_class_contrast(values, with_object(extent().usual, seed));
}

std::unique_ptr<energy::ShapeEnergy<3>> ImageModel::mumford_shah(
    const PiecewiseSmooth& parameters) const {
  energy::MumfordShahOptions options;
  options.mu = parameters.mu;
  options.gamma = parameters.gamma;
  options.contrast = parameters.contrast;
  return std::make_unique<energy::MumfordShah>(intensity_, smoothed_.grid(), options);
}

}  // namespace surf::segment
