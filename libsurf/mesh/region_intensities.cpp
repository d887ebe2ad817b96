#include "libsurf/mesh/region_intensities.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/rasterize.h"

namespace surf::mesh {
namespace {

using Index = std::array<int, 3>;

IntensityStatistics statistics(std::vector<float> values) {
  IntensityStatistics out;
  out.n_voxels = values.size();
  if (values.empty()) return out;
  std::sort(values.begin(), values.end());
  const auto n = double(values.size());
  for (const float value : values) out.mean += value / n;
  double squares = 0;
  for (const float value : values) squares += (value - out.mean) * (value - out.mean);
  if (values.size() > 1) out.standard_deviation = std::sqrt(squares / (n - 1));
  const auto quantile = [&](double share) { return values[std::size_t(share * (n - 1))]; };
  out.median = quantile(0.5);
  out.percentile_5 = quantile(0.05);
  out.percentile_95 = quantile(0.95);
  return out;
}

/// Voxels near a surface, block by block: a block is taken or left as a whole where the distance of
/// its centre says so, since the distance changes by no more than the way.
class Shell {
 public:
  Shell(const Triangles& surface, const Eigen::Affine3d& index_to_world, double shell_mm)
      : distance_(surface), index_to_world_(index_to_world), shell_mm_(shell_mm) {}

  /// Calls take(i, j, k) for the voxels lower <= index < upper.
  template <class Take>
  void visit(const Index& lower, const Index& upper, const Take& take) const {
    Vector<3> center, half;
    int longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (lower[axis] >= upper[axis]) return;
      center[axis] = 0.5 * (lower[axis] + upper[axis] - 1);
      half[axis] = 0.5 * (upper[axis] - 1 - lower[axis]);
      if (half[axis] > half[longest]) longest = axis;
    }
    const double away = distance_(index_to_world_ * center);
    const double reach = (index_to_world_.linear().cwiseAbs() * half).norm();
    if (away - reach > shell_mm_) return;
    if (away + reach <= shell_mm_) {
      for (int k = lower[2]; k < upper[2]; ++k)
        for (int j = lower[1]; j < upper[1]; ++j)
          for (int i = lower[0]; i < upper[0]; ++i) take(i, j, k);
      return;
    }
    Index middle_upper = upper, middle_lower = lower;
    middle_upper[longest] = middle_lower[longest] = (lower[longest] + upper[longest]) / 2;
    visit(lower, middle_upper, take);
    visit(middle_lower, upper, take);
  }

 private:
  DistanceToSurface distance_;
  Eigen::Affine3d index_to_world_;
  double shell_mm_;
};

}  // namespace

RegionIntensities region_intensities(const Triangles& surface, const volume::Volume& volume,
                                     double shell_mm) {
  const Eigen::Affine3d& to_index = volume.world_to_index();
  Index lower = {0, 0, 0}, upper = volume.size(), size{};
  const Points<3> at = (surface.points * to_index.linear().transpose()).rowwise() +
                       to_index.translation().transpose();
  for (int axis = 0; axis < 3; ++axis) {
    const double reach = shell_mm * to_index.linear().row(axis).norm();
    lower[axis] = int(
        std::clamp(std::floor(at.col(axis).minCoeff() - reach), 0.0, double(volume.size()[axis])));
    upper[axis] = int(std::clamp(std::ceil(at.col(axis).maxCoeff() + reach) + 1,
                                 double(lower[axis]), double(volume.size()[axis])));
    size[axis] = upper[axis] - lower[axis];
  }
  RegionIntensities out;
  out.shell_mm = shell_mm;
  if (std::count(size.begin(), size.end(), 0) > 0) return out;
  std::vector<float> values(std::size_t(size[0]) * size[1] * size[2]);
  volume.copy_box(lower, upper, values.data());
  const Eigen::Affine3d to_world =
      volume.index_to_world() * Eigen::Translation3d(lower[0], lower[1], lower[2]);
  const std::vector<std::uint8_t> is_inside = rasterize(surface, size, to_world);
  std::vector<float> inside, shell;
  for (std::size_t n = 0; n < values.size(); ++n)
    if (is_inside[n]) inside.push_back(values[n]);
  Shell(surface, to_world, shell_mm).visit({0, 0, 0}, size, [&](int i, int j, int k) {
    const std::size_t n = (std::size_t(k) * size[1] + j) * size[0] + i;
    if (!is_inside[n]) shell.push_back(values[n]);
  });
  out.inside = statistics(std::move(inside));
  out.shell = statistics(std::move(shell));
  return out;
}

}  // namespace surf::mesh
