#include "libsurf/volume/detail/block_means.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "libsurf/volume/orientation.h"

namespace surf::volume {
namespace {

constexpr double kBlocks = 1 << 22;  // at least, where blocks are cubes
// Voxels per block: in 512 x 512 x 300 voxels blocks of 8 save the search no more than they cost.
constexpr double kLeastGain = 16;
constexpr double kSlack = 1e-9;  // of a voxel: a block's side is rounded down to voxels

std::array<int, 3> n_blocks(const std::array<int, 3>& size, const std::array<int, 3>& block) {
  std::array<int, 3> out;
  for (int axis = 0; axis < 3; ++axis) out[axis] = (size[axis] + block[axis] - 1) / block[axis];
  return out;
}

std::array<int, 3> missing_voxels(const std::array<int, 3>& size,
                                  const Eigen::Affine3d& index_to_world,
                                  const std::array<int, 3>& block) {
  const AxisOrder order = ras_order(index_to_world);
  const std::array<int, 3> n = n_blocks(size, block);
  std::array<int, 3> out;
  for (int place = 0; place < 3; ++place) {
    const int axis = order.axes[place];
    out[axis] = order.are_reversed[place] ? n[axis] * block[axis] - size[axis] : 0;
  }
  return out;
}

Eigen::Matrix4d block_to_world(const Eigen::Affine3d& index_to_world,
                               const std::array<int, 3>& block, const std::array<int, 3>& missing) {
  Eigen::Vector3d scale, first;
  for (int axis = 0; axis < 3; ++axis) {
    scale[axis] = block[axis];
    first[axis] = (block[axis] - 1) / 2.0 - missing[axis];
  }
  return (index_to_world * Eigen::Translation3d(first) * Eigen::Scaling(scale)).matrix();
}

}  // namespace

std::optional<std::array<int, 3>> block_size(const std::array<int, 3>& size,
                                             const Eigen::Affine3d& index_to_world) {
  const Eigen::Vector3d spacing = index_to_world.linear().colwise().norm();
  double content = 1, n_voxels = 1, n = 1;
  for (int axis = 0; axis < 3; ++axis) {
    content *= size[axis] * spacing[axis];
    n_voxels *= size[axis];
  }
  const double side = std::cbrt(content / kBlocks);
  std::array<int, 3> block;
  for (int axis = 0; axis < 3; ++axis) {
    // Two blocks along each axis, as any volume has.
    block[axis] = int(std::clamp(side / spacing[axis] + kSlack, 1.0, (size[axis] + 1) / 2.0));
    n *= std::ceil(double(size[axis]) / block[axis]);
  }
  if (n * kLeastGain > n_voxels) return std::nullopt;
  return block;
}

BlockMeans::BlockMeans(const std::array<int, 3>& size, const Eigen::Affine3d& index_to_world,
                       const std::array<int, 3>& block, const Source& source)
    : size_(size),
      block_(block),
      n_blocks_(n_blocks(size, block)),
      missing_(missing_voxels(size, index_to_world, block)),
      rows_(std::size_t(size[0]) * n_blocks_[1]),
      builder_(n_blocks_, block_to_world(index_to_world, block, missing_), source) {}

BlockMeans::Range BlockMeans::block_range(int axis, int at) const {
  const int begin = at * block_[axis] - missing_[axis];
  return {std::max(begin, 0), std::min(begin + block_[axis], size_[axis])};
}

void BlockMeans::add(std::span<const float> slab, int first) {
  const auto row = std::size_t(size_[0]), slice = row * std::size_t(size_[1]);
  const int end = first + int(slab.size() / slice);
  const auto block_of = [&](int k) { return (k + missing_[2]) / block_[2]; };
  const int first_block = block_of(first);
  // Those that end in this slab.
  const int n_whole = end == size_[2] ? n_blocks_[2] - first_block : block_of(end) - first_block;
  std::vector<std::vector<float>> means(
      std::size_t(n_whole), std::vector<float>(std::size_t(n_blocks_[0]) * n_blocks_[1]));
  tbb::parallel_for(0, n_blocks_[1], [&](int at_j) {
    const std::span<double> sums(rows_.data() + at_j * row, row);
    const Range js = block_range(1, at_j);
    for (int k = first; k < end; ++k) {
      for (int j = js.begin; j < js.end; ++j) {
        const float* from = slab.data() + (k - first) * slice + j * row;
        for (std::size_t i = 0; i < row; ++i) sums[i] += from[i];
      }
      const Range ks = block_range(2, block_of(k));
      if (k + 1 < ks.end) continue;
      float* to =
          means[std::size_t(block_of(k) - first_block)].data() + std::size_t(at_j) * n_blocks_[0];
      for (int at_i = 0; at_i < n_blocks_[0]; ++at_i) {
        const Range is = block_range(0, at_i);
        double sum = 0;
        for (int i = is.begin; i < is.end; ++i) sum += sums[std::size_t(i)];
        to[at_i] =
            float(sum / (double(is.end - is.begin) * (js.end - js.begin) * (ks.end - ks.begin)));
      }
      std::fill(sums.begin(), sums.end(), 0.0);
    }
  });
  for (const std::vector<float>& values : means) builder_.append_slice(values);
}

}  // namespace surf::volume
