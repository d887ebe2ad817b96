#include "libsurf/volume/detail/voxel_grid.h"

#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <variant>
#include <vector>

namespace surf::volume {
namespace {

template <class T>
using TreeOf = typename openvdb::tree::Tree4<T, 5, 4, 3>::Type;  // FloatGrid's

/// What is asked for are floats, which hold whole numbers of 8 and 16 bits exactly.
using AnyTree = std::variant<std::unique_ptr<TreeOf<std::uint8_t>>,
                             std::unique_ptr<TreeOf<std::int16_t>>, std::unique_ptr<TreeOf<float>>>;

template <class T>
void make_kind(AnyTree& tree) {
  tree = std::visit(
      [](auto& old) {
        if constexpr (sizeof(typename std::decay_t<decltype(*old)>::ValueType) < sizeof(T))
          return AnyTree(std::make_unique<TreeOf<T>>(*old));
        else
          return AnyTree(std::move(old));
      },
      tree);
}

/// The last index of a leaf lies densest in memory, as i does in a slice.
openvdb::Coord place_of(int i, int j, int k) { return {k, j, i}; }

/// Zeros have signs.
template <class T>
bool is_identical(T a, T b) {
  return a == b && std::signbit(double(a)) == std::signbit(double(b));
}

/// Slices first <= k < first + depth into the tree, a leaf at a time; leaves of one value become
/// tiles. (By openvdb::tools::copyFromDense reading 512 x 512 x 300 voxels took 1.23 s, not 0.7.)
template <class Tree>
void store_leaves(Tree& tree, std::span<const float> slab, const std::array<int, 3>& size,
                  int first, int depth) {
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;
  constexpr int kSlab = VoxelGrid::kSlab;
  static_assert(Leaf::DIM == kSlab);
  const int n_rows = (size[1] + kSlab - 1) / kSlab, n_in_row = (size[0] + kSlab - 1) / kSlab;
  const std::size_t n = std::size_t(size[0]) * size[1];
  std::vector<std::unique_ptr<Leaf>> leaves(std::size_t(n_rows) * n_in_row);
  std::vector<Value> values(leaves.size());  // of those that have one value
  tbb::parallel_for(0, n_rows, [&](int row) {
    const int low_j = row * kSlab, n_j = std::min(kSlab, size[1] - low_j);
    for (int place = 0; place < n_in_row; ++place) {
      const int low_i = place * kSlab, n_i = std::min(kSlab, size[0] - low_i);
      auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), place_of(low_i, low_j, first),
                                         Value(0), false);
      leaf->allocate();
      Value* out = leaf->buffer().data();
      const bool is_full = n_i == kSlab && n_j == kSlab && depth == kSlab;
      if (!is_full) std::fill(out, out + Leaf::SIZE, Value(0));
      const auto value0 = static_cast<Value>(slab[std::size_t(low_j) * size[0] + low_i]);
      bool is_same = is_full || is_identical(value0, Value(0));
      for (int k = 0; k < depth; ++k)
        for (int j = 0; j < n_j; ++j) {
          const float* from = slab.data() + k * n + std::size_t(low_j + j) * size[0] + low_i;
          Value* to = out + (k * kSlab + j) * kSlab;
          if (n_i == kSlab)  // which the compiler knows
            std::transform(from, from + kSlab, to, [](float v) { return static_cast<Value>(v); });
          else
            std::transform(from, from + n_i, to, [](float v) { return static_cast<Value>(v); });
          is_same = is_same &&
                    std::all_of(to, to + n_i, [&](Value v) { return is_identical(v, value0); });
        }
      const std::size_t at = std::size_t(row) * n_in_row + place;
      if (is_same)
        values[at] = value0;
      else
        leaves[at] = std::move(leaf);
    }
  });
  for (std::size_t at = 0; at < leaves.size(); ++at) {
    if (leaves[at])
      tree.addLeaf(leaves[at].release());
    else if (!is_identical(values[at], Value(0)))
      tree.addTile(1, place_of(int(at % n_in_row) * kSlab, int(at / n_in_row) * kSlab, first),
                   values[at], false);
  }
}

/// Asks for memory that is read soon.
void prefetch(const void* from, std::size_t n_bytes) {
  constexpr std::size_t kLine = 64;
  for (std::size_t at = 0; at < n_bytes; at += kLine)
    __builtin_prefetch(static_cast<const char*>(from) + at);
}

/// A row of leaves at a time: they lie anywhere, and so does what each of them points to, so that
/// all of a row are asked for before the first one is read. (By openvdb::tools::copyToDense a box
/// of 124^3 voxels took twice as long.)
template <class Tree>
void copy_leaves(const Tree& tree, const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                 float* out) {
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;
  constexpr int kSlab = VoxelGrid::kSlab;
  const std::ptrdiff_t row = upper[0] - lower[0], slice = row * (upper[1] - lower[1]);
  openvdb::tree::ValueAccessor<const Tree> accessor(tree);
  const auto end_of_leaf = [&](int index, int axis) {
    return std::min(upper[axis], (index / kSlab + 1) * kSlab);
  };
  std::vector<const Leaf*> leaves;
  std::vector<const Value*> values;
  for (int k0 = lower[2], k1 = 0; k0 < upper[2]; k0 = k1) {
    k1 = end_of_leaf(k0, 2);
    for (int j0 = lower[1], j1 = 0; j0 < upper[1]; j0 = j1) {
      j1 = end_of_leaf(j0, 1);
      leaves.clear();
      for (int i = lower[0]; i < upper[0]; i = end_of_leaf(i, 0)) {
        leaves.push_back(accessor.probeConstLeaf(place_of(i, j0, k0)));
        if (leaves.back()) prefetch(leaves.back(), sizeof(Leaf));
      }
      values.clear();
      for (const Leaf* leaf : leaves) {
        values.push_back(leaf ? leaf->buffer().data() : nullptr);
        if (leaf) prefetch(values.back(), Leaf::SIZE * sizeof(Value));
      }
      auto from = values.begin();
      for (int i0 = lower[0], i1 = 0; i0 < upper[0]; i0 = i1, ++from) {
        i1 = end_of_leaf(i0, 0);
        const float same = *from ? 0 : float(accessor.getValue(place_of(i0, j0, k0)));
        for (int k = k0; k < k1; ++k)
          for (int j = j0; j < j1; ++j) {
            float* to = out + (k - lower[2]) * slice + (j - lower[1]) * row + (i0 - lower[0]);
            const int first = (k % kSlab * kSlab + j % kSlab) * kSlab + i0 % kSlab;
            if (!*from)
              std::fill_n(to, i1 - i0, same);
            else if (i1 - i0 == kSlab)  // which the compiler knows
              std::copy_n(*from + first, kSlab, to);
            else
              std::copy_n(*from + first, i1 - i0, to);
          }
      }
    }
  }
}

class OpenVdbVoxels final : public VoxelGrid {
 public:
  explicit OpenVdbVoxels(const std::array<int, 3>& size)
      : size_(size), tree_(std::make_unique<TreeOf<std::uint8_t>>(std::uint8_t(0))) {}

  int bytes_per_voxel() const override { return 1 << tree_.index(); }

  void widen(int bytes_per_voxel) override {
    if (bytes_per_voxel == 2) make_kind<std::int16_t>(tree_);
    if (bytes_per_voxel == 4) make_kind<float>(tree_);
  }

  void store_slab(std::span<const float> slab, int first) override {
    const auto depth = int(slab.size() / (std::size_t(size_[0]) * size_[1]));
    std::visit([&](auto& tree) { store_leaves(*tree, slab, size_, first, depth); }, tree_);
  }

  float value(const std::array<int, 3>& index) const override {
    const openvdb::Coord at = place_of(index[0], index[1], index[2]);
    return std::visit([&](const auto& tree) { return float(tree->getValue(at)); }, tree_);
  }

  void copy_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                float* out) const override {
    std::visit([&](const auto& tree) { copy_leaves(*tree, lower, upper, out); }, tree_);
  }

 private:
  std::array<int, 3> size_;
  AnyTree tree_;
};

std::unique_ptr<VoxelGrid> make_voxel_grid(const std::array<int, 3>& size) {
  return std::make_unique<OpenVdbVoxels>(size);
}

}  // namespace

extern "C" {
std::unique_ptr<VoxelGrid> (*const surf_make_voxel_grid)(const std::array<int, 3>&) =
    make_voxel_grid;
}

}  // namespace surf::volume
