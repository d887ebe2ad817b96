#include "libsurf/segment/seed_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surf::segment {
namespace {

constexpr int kLargestRadius = 16;  // voxels; more says nothing new and costs radius^3

/// Points of a cubic lattice of this spacing with inner < |x - center| <= outer. Radii are
/// multiples of the spacing, and many points lie at them: a slack keeps rounding from choosing
/// among these.
Points<3> lattice_shell(const Eigen::Vector3d& center, double spacing, double inner, double outer) {
  std::vector<Eigen::Vector3d> points;
  const int n = static_cast<int>(std::ceil(outer / spacing));
  for (int k = -n; k <= n; ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const Eigen::Vector3d offset = spacing * Eigen::Vector3d(i, j, k);
        const double r = offset.norm() - 1e-9 * spacing;
        if (r <= outer && r > inner) points.push_back(center + offset);
      }
  Points<3> out(points.size(), 3);
  for (std::size_t i = 0; i < points.size(); ++i) out.row(i) = points[i];
  return out;
}

std::vector<double> values_at(const Field<3>& I, const Points<3>& x) {
  Samples<3> samples;
  I.sample(x, Derivatives::kNone, samples);
  return {samples.value.data(), samples.value.data() + samples.value.size()};
}

double median_deviation(const std::vector<double>& values, double centre) {
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return 1.4826 * median(std::move(distances));
}

double estimate_noise(const Field<3>& I, std::span<const Eigen::Vector3d> seeds, double voxel_mm) {
  std::vector<double> seconds;
  for (const Eigen::Vector3d& seed : seeds) {
    const Points<3> x = lattice_shell(seed, voxel_mm, -1, 4 * voxel_mm);
    const std::vector<double> here = values_at(I, x);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::RowVector3d step = voxel_mm * Eigen::RowVector3d::Unit(axis);
      const std::vector<double> plus = values_at(I, x.rowwise() + step);
      const std::vector<double> minus = values_at(I, x.rowwise() - step);
      for (std::size_t i = 0; i < here.size(); ++i)
        seconds.push_back(std::abs(plus[i] - 2 * here[i] + minus[i]));
    }
  }
  return 1.4826 * median(std::move(seconds)) / std::sqrt(6.0);
}

/// |grad I| along a ray up to its first pronounced peak: it exceeds `background` five times
/// and then falls to half. The largest value met if there is no such peak.
double first_peak(const Field<3>& I, const Eigen::Vector3d& seed, const Eigen::Vector3d& direction,
                  double step_mm, double background, const volume::Volume& volume) {
  constexpr int kBatch = 32;
  Samples<3> samples;
  double highest = 0;
  for (int batch = 0; batch < 1000; ++batch) {
    Points<3> x(kBatch, 3);
    for (int i = 0; i < kBatch; ++i) x.row(i) = seed + (batch * kBatch + i) * step_mm * direction;
    I.sample(x, Derivatives::kFirst, samples);
    for (int i = 0; i < kBatch; ++i) {
      const Eigen::Vector3d index = volume.world_to_index() * x.row(i).transpose();
      const Eigen::Map<const Eigen::Array3i> size(volume.size().data());
      if ((index.array() < 0).any() || (index.array() > (size - 1).cast<double>()).any())
        return highest;
      const double gradient = samples.gradient.row(i).norm();
      if (highest > 5 * background && gradient < highest / 2) return highest;
      highest = std::max(highest, gradient);
    }
  }
  return highest;
}

}  // namespace

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Points<3> sphere_directions(int n) {
  Points<3> out(n, 3);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, rho = std::sqrt(1 - z * z);
    out.row(i) << rho * std::cos(golden * i), rho * std::sin(golden * i), z;
  }
  return out;
}

SeedModel estimate_seed_model(const Field<3>& I, std::span<const Eigen::Vector3d> seeds,
                              double voxel_mm) {
  SeedModel model;
  model.noise = estimate_noise(I, seeds, voxel_mm);
  std::vector<double> ball;
  double first_mean = 0, first_deviation = 0;
  for (int radius = 2; radius <= kLargestRadius; ++radius) {
    std::vector<double> shell;
    for (const Eigen::Vector3d& seed : seeds) {
      const auto values =
          values_at(I, lattice_shell(seed, voxel_mm, radius == 2 ? -1 : (radius - 1) * voxel_mm,
                                     radius * voxel_mm));
      shell.insert(shell.end(), values.begin(), values.end());
    }
    if (radius > 2) {
      const auto n_inside = std::count_if(shell.begin(), shell.end(), [&](double value) {
        return std::abs(value - model.mean) <= 2.5 * model.deviation;
      });
      if (double(n_inside) < 0.85 * double(shell.size())) break;
    }
    std::vector<double> grown = ball;
    grown.insert(grown.end(), shell.begin(), shell.end());
    const double mean = median(grown);
    const double deviation = std::max(median_deviation(grown, mean), model.noise);
    if (radius == 2) {
      first_mean = mean;
      first_deviation = deviation;
    } else if (deviation > 2 * first_deviation || std::abs(mean - first_mean) > first_deviation) {
      break;
    }
    ball = std::move(grown);
    model.mean = mean;
    model.deviation = deviation;
    model.radius_mm = radius * voxel_mm;
  }
  return model;
}

double estimate_edge_strength(const Field<3>& I, std::span<const Eigen::Vector3d> seeds,
                              const volume::Volume& volume) {
  constexpr int kRays = 42;  // each costs the tiles it crosses
  const double voxel_mm = volume.voxel_size();
  const Points<3> directions = sphere_directions(kRays);
  std::vector<double> near, peaks;
  for (const Eigen::Vector3d& seed : seeds) {
    Samples<3> samples;
    I.sample(lattice_shell(seed, voxel_mm, -1, 3 * voxel_mm), Derivatives::kFirst, samples);
    for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
      near.push_back(samples.gradient.row(i).norm());
  }
  // Without noise the background is 0, and every ripple would count as a peak.
  const auto [lowest, highest] = volume.range();
  const double background = std::max(median(near), 2e-3 * (double(highest) - lowest) / voxel_mm);
  for (const Eigen::Vector3d& seed : seeds)
    for (int ray = 0; ray < kRays; ++ray)
      peaks.push_back(first_peak(I, seed, directions.row(ray), voxel_mm / 2, background, volume));
  return std::max({0.25 * median(peaks), 3 * background, 1e-30});
}

}  // namespace surf::segment
