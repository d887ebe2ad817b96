#include "libsurf/segment/seed_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surf::segment {
namespace {

constexpr int kLargestRadius = 16;  // voxels; more says nothing new and costs radius^3

/// Points of a square or cubic lattice of this spacing with inner < |x - center| <= outer. Radii
/// are multiples of the spacing, and many points lie at them: a slack keeps rounding from choosing
/// among these.
template <int Dim>
Points<Dim> lattice_shell(const Vector<Dim>& center, double spacing, double inner, double outer) {
  std::vector<Vector<Dim>> points;
  const int n = static_cast<int>(std::ceil(outer / spacing));
  for (int k = Dim == 3 ? -n : 0; k <= (Dim == 3 ? n : 0); ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const Vector<Dim> offset = spacing * Eigen::Vector3d(i, j, k).template head<Dim>();
        const double r = offset.norm() - 1e-9 * spacing;
        if (r <= outer && r > inner) points.push_back(center + offset);
      }
  Points<Dim> out(points.size(), Dim);
  for (std::size_t i = 0; i < points.size(); ++i) out.row(i) = points[i];
  return out;
}

template <int Dim>
std::vector<double> values_at(const Field<Dim>& I, const Points<Dim>& x) {
  Samples<Dim> samples;
  I.sample(x, Derivatives::kNone, samples);
  return {samples.value.data(), samples.value.data() + samples.value.size()};
}

double median_deviation(const std::vector<double>& values, double centre) {
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return 1.4826 * median(std::move(distances));
}

template <int Dim>
double estimate_noise(const Field<Dim>& I, std::span<const Vector<Dim>> seeds, double voxel_mm) {
  std::vector<double> seconds;
  for (const Vector<Dim>& seed : seeds) {
    const Points<Dim> x = lattice_shell<Dim>(seed, voxel_mm, -1, 4 * voxel_mm);
    const std::vector<double> here = values_at<Dim>(I, x);
    for (int axis = 0; axis < Dim; ++axis) {
      const Eigen::Matrix<double, 1, Dim> step = voxel_mm * Vector<Dim>::Unit(axis).transpose();
      const std::vector<double> plus = values_at<Dim>(I, x.rowwise() + step);
      const std::vector<double> minus = values_at<Dim>(I, x.rowwise() - step);
      for (std::size_t i = 0; i < here.size(); ++i)
        seconds.push_back(std::abs(plus[i] - 2 * here[i] + minus[i]));
    }
  }
  return 1.4826 * median(std::move(seconds)) / std::sqrt(6.0);
}

/// |grad I| along a ray up to its first pronounced peak: it exceeds `background` five times
/// and then falls to half. The largest value met if there is no such peak.
template <int Dim>
double first_peak(const Field<Dim>& I, const Vector<Dim>& seed, const Vector<Dim>& direction,
                  double step_mm, double background, const ImageExtent<Dim>& extent) {
  constexpr int kBatch = 32;
  Samples<Dim> samples;
  double highest = 0;
  for (int batch = 0; batch < 1000; ++batch) {
    Points<Dim> x(kBatch, Dim);
    for (int i = 0; i < kBatch; ++i) x.row(i) = seed + (batch * kBatch + i) * step_mm * direction;
    I.sample(x, Derivatives::kFirst, samples);
    for (int i = 0; i < kBatch; ++i) {
      if (!extent.contains(x.row(i).transpose())) return highest;
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

template <>
Points<2> directions<2>(int n) {
  Points<2> out(n, 2);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / n;
    out.row(i) << std::cos(angle), std::sin(angle);
  }
  return out;
}

template <>
Points<3> directions<3>(int n) {
  Points<3> out(n, 3);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2 * i + 1.0) / n, rho = std::sqrt(1 - z * z);
    out.row(i) << rho * std::cos(golden * i), rho * std::sin(golden * i), z;
  }
  return out;
}

template <int Dim>
SeedModel estimate_seed_model(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              double voxel_mm) {
  SeedModel model;
  model.noise = estimate_noise<Dim>(I, seeds, voxel_mm);
  std::vector<double> ball;
  double first_mean = 0, first_deviation = 0;
  for (int radius = 2; radius <= kLargestRadius; ++radius) {
    std::vector<double> shell;
    for (const Vector<Dim>& seed : seeds) {
      const auto values = values_at<Dim>(
          I, lattice_shell<Dim>(seed, voxel_mm, radius == 2 ? -1 : (radius - 1) * voxel_mm,
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

template <int Dim>
double estimate_edge_strength(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent) {
  constexpr int kRays = 42;  // each costs the tiles it crosses
  const double voxel_mm = extent.cell_mm();
  const Points<Dim> rays = directions<Dim>(kRays);
  std::vector<double> near, peaks;
  for (const Vector<Dim>& seed : seeds) {
    Samples<Dim> samples;
    I.sample(lattice_shell<Dim>(seed, voxel_mm, -1, 3 * voxel_mm), Derivatives::kFirst, samples);
    for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
      near.push_back(samples.gradient.row(i).norm());
  }
  // Without noise the background is 0, and every ripple would count as a peak.
  const auto [lowest, highest] = extent.range;
  const double background = std::max(median(near), 2e-3 * (double(highest) - lowest) / voxel_mm);
  for (const Vector<Dim>& seed : seeds)
    for (int ray = 0; ray < kRays; ++ray)
      peaks.push_back(first_peak<Dim>(I, seed, rays.row(ray), voxel_mm / 2, background, extent));
  return std::max({0.25 * median(peaks), 3 * background, 1e-30});
}

template SeedModel estimate_seed_model<2>(const Field<2>&, std::span<const Vector<2>>, double);
template SeedModel estimate_seed_model<3>(const Field<3>&, std::span<const Vector<3>>, double);
template double estimate_edge_strength<2>(const Field<2>&, std::span<const Vector<2>>,
                                          const ImageExtent<2>&);
template double estimate_edge_strength<3>(const Field<3>&, std::span<const Vector<3>>,
                                          const ImageExtent<3>&);

}  // namespace surf::segment
