#include "libsurf/mesh/overlap.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"
#include "libsurf/base/memory.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/rasterize.h"

namespace surf::mesh {
namespace {

constexpr int kSlab = 8;            // voxels
constexpr double kMost = 1e10;      // voxels: two minutes
constexpr int kFarthest = 1 << 29;  // index, so that sizes and sums stay within an int

/// Why a box from `lower` to `upper` is not to be compared; empty if it is.
std::string refusal(const Vector<3>& lower, const Vector<3>& upper, const volume::Volume& labels,
                    int s) {
  const double farthest = std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff());
  if (!(farthest * s <= kFarthest)) return "too far away";
  const Vector<3> size = upper - lower;
  if (size.prod() > std::max(kMost, 8.0 * double(labels.n_voxels()))) return "too many";
  const double n_per_voxel = std::pow(s, 3);
  // A value, then its mark beside what rasterize() takes: a change of 16 bits and a mark.
  const double n_bytes = std::max(5.0, 1 + 3 * n_per_voxel);
  if (fits_in_memory(n_bytes * size[0] * size[1] * std::min<double>(kSlab, size[2]))) return {};
  return fmt::format("too many ({})", usable_memory_text());
}

/// Voxels whose parallelepiped the surface may meet.
/// @param s  samples per axis of each
IndexBox<3> box_of(const Triangles& surface, const volume::Volume& labels, int s) {
  const Eigen::Affine3d& world_to_index = labels.world_to_index();
  Eigen::AlignedBox3d box;
  for (const auto element : surface.elements.rowwise())
    for (const int vertex : element)
      box.extend(world_to_index * Vector<3>(surface.points.row(vertex)));
  if (box.isEmpty()) return {};
  const Vector<3> lower = (box.min().array() + 0.5).floor(),
                  upper = (box.max().array() + 0.5).floor() + 1;
  if (const std::string why = refusal(lower, upper, labels, s); !why.empty())
    throw InputError(fmt::format(
        "the surface spans the voxels ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) of the "
        "label map, which has {} x {} x {}: {} to compare; is it in another unit or space?",
        lower[0], lower[1], lower[2], upper[0] - 1, upper[1] - 1, upper[2] - 1, labels.size()[0],
        labels.size()[1], labels.size()[2], why));
  const auto index = [](const Vector<3>& at) {
    return std::array<int, 3>{int(at[0]), int(at[1]), int(at[2])};
  };
  return IndexBox<3>::between(index(lower), index(upper));
}

/// Grid of s samples per axis in each voxel of the box: sample (0, 0, 0) is the first in the
/// voxel `lower`.
Eigen::Affine3d sample_to_world(const Eigen::Affine3d& index_to_world,
                                const std::array<int, 3>& lower, int s) {
  const Vector<3> first =
      Vector<3>(lower[0], lower[1], lower[2]) + Vector<3>::Constant(0.5 / s - 0.5);
  return index_to_world * Eigen::Translation3d(first) * Eigen::Scaling(1.0 / s);
}

/// Labels of the box; outside the volume nothing is labelled.
std::vector<std::uint8_t> labelled(const volume::Volume& labels, std::optional<int> label,
                                   const IndexBox<3>& box) {
  std::vector<float> values(box.n());
  labels.copy_box(box.lower, box.upper(), values.data());
  const IndexBox<3> whole{{0, 0, 0}, labels.size()};
  std::vector<std::uint8_t> result(values.size());
  for (std::size_t at = 0; at < values.size(); ++at)
    result[at] = whole.contains(box.node(at)) && is_labelled(values[at], label);
  return result;
}

std::size_t n_labelled(const volume::Volume& labels, std::optional<int> label) {
  std::vector<float> slice(std::size_t(labels.size()[0]) * labels.size()[1]);
  std::size_t n = 0;
  for (int k = 0; k < labels.size()[2]; ++k) {
    labels.copy_box({0, 0, k}, {labels.size()[0], labels.size()[1], k + 1}, slice.data());
    n += std::count_if(slice.begin(), slice.end(),
                       [&](float value) { return is_labelled(value, label); });
  }
  return n;
}

struct SampleCounts {
  std::size_t inside = 0, common = 0;
};

SampleCounts count_slab(const Triangles& surface, const volume::Volume& labels,
                        std::optional<int> label, const IndexBox<3>& slab, int s) {
  const std::vector<std::uint8_t> mask = labelled(labels, label, slab);
  const std::array<int, 3> size{slab.size[0] * s, slab.size[1] * s, slab.size[2] * s};
  const std::vector<std::uint8_t> inside =
      rasterize(surface, size, sample_to_world(labels.index_to_world(), slab.lower, s));
  SampleCounts counts;
  std::size_t at = 0;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i, ++at) {
        if (!inside[at]) continue;
        ++counts.inside;
        counts.common += mask[(std::size_t(k / s) * slab.size[1] + j / s) * slab.size[0] + i / s];
      }
  return counts;
}

}  // namespace

Overlap overlap(const Triangles& surface, const volume::Volume& labels, std::optional<int> label,
                int samples_per_axis) {
  check_label(label);
  const IndexBox<3> box = box_of(surface, labels, samples_per_axis);
  const int end = box.upper()[2];
  SampleCounts counts;
  for (int k = box.lower[2]; k < end; k += kSlab) {
    IndexBox<3> slab = box;
    slab.lower[2] = k;
    slab.size[2] = std::min(kSlab, end - k);
    const SampleCounts of_slab = count_slab(surface, labels, label, slab, samples_per_axis);
    counts.inside += of_slab.inside;
    counts.common += of_slab.common;
  }
  const double voxel_mm3 = std::abs(labels.index_to_world().linear().determinant());
  const double sample_mm3 = voxel_mm3 / std::pow(samples_per_axis, 3);
  return {double(counts.inside) * sample_mm3, double(n_labelled(labels, label)) * voxel_mm3,
          double(counts.common) * sample_mm3};
}

Overlap overlap(const Triangles& first, const Triangles& second, int samples_along) {
  Eigen::AlignedBox3d box;
  for (const Triangles* surface : {&first, &second})
    for (const auto element : surface->elements.rowwise())
      for (const int vertex : element) box.extend(Vector<3>(surface->points.row(vertex)));
  if (box.isEmpty()) return {};
  // Along each axis its own: between the points of a cubic grid a thin plate is lost.
  const Vector<3> spacing = box.sizes() / samples_along;
  const double sample_mm3 = spacing.prod();
  if (!(sample_mm3 > 0)) return {};
  const std::array<int, 3> size{samples_along, samples_along, samples_along};
  const Eigen::Affine3d grid = Eigen::Translation3d(box.min()) * Eigen::Scaling(spacing) *
                               Eigen::Translation3d(Vector<3>::Constant(0.5));
  const auto a = rasterize(first, size, grid), b = rasterize(second, size, grid);
  std::size_t n_first = 0, n_second = 0, n_common = 0;
  for (std::size_t at = 0; at < a.size(); ++at) {
    n_first += a[at];
    n_second += b[at];
    n_common += a[at] & b[at];
  }
  return {double(n_first) * sample_mm3, double(n_second) * sample_mm3,
          double(n_common) * sample_mm3};
}

}  // namespace surf::mesh
