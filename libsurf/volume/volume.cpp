#include "libsurf/volume/volume.h"

#include <fmt/format.h>
#include <openvdb/tools/Dense.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <type_traits>
#include <utility>

#include "libsurf/base/affine.h"
#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/base/values.h"
#include "libsurf/volume/detail/openvdb_grid.h"

namespace surf::volume {
namespace {

constexpr int kSlab = 8;  // slices handed over at once: an OpenVDB leaf is 8^3

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>;

/// @param n_bytes  that are needed
/// @param words    what they are
void check_memory(double n_bytes, const char* words, const std::array<int, 3>& size,
                  const std::string& path) {
  if (!fits_in_memory(n_bytes))
    throw InputError(fmt::format(
        "{}: {} x {} x {} voxels need {:.1f} GiB{}, {}; crop or resample "
        "the volume first",
        path, size[0], size[1], size[2], n_bytes / (1 << 30), words, usable_memory_text()));
}

void check_size(const std::array<int, 3>& size, const std::string& path) {
  for (int axis = 0; axis < 3; ++axis)
    if (size[axis] < 2)
      throw InputError(
          fmt::format("{}: {} x {} x {} voxels; a volume needs at least 2 along every axis", path,
                      size[0], size[1], size[2]));
  const double slice = double(size[0]) * size[1];
  check_memory(slice * size[2] + 2 * sizeof(float) * slice * std::min(size[2], kSlab), " at least",
               size, path);
}

struct SliceValues {
  bool are_usable = true;
  float lowest = std::numeric_limits<float>::max(), highest = std::numeric_limits<float>::lowest();
  /// The least kind of grid, by its place in AnyGrid, that holds them.
  std::size_t kind = 0;
};

SliceValues values_of(std::span<const float> values) {
  SliceValues out;
  bool are_whole = true;
  for (const float value : values) {
    out.are_usable &= is_usable_value(value);
    out.lowest = std::min(out.lowest, value);
    out.highest = std::max(out.highest, value);
    const bool is_short = value >= -32768 && value <= 32767;
    const int whole = is_short ? int(value) : 0;
    are_whole &= is_short && float(whole) == value && !(whole == 0 && std::signbit(value));
  }
  if (!are_whole)
    out.kind = 2;
  else if (out.lowest < 0 || out.highest > 255)
    out.kind = 1;
  return out;
}

template <class T>
void make_kind(AnyGrid& grid) {
  grid = std::visit(
      [](const auto& old) {
        if constexpr (sizeof(typename std::decay_t<decltype(*old)>::ValueType) < sizeof(T))
          return AnyGrid(std::make_shared<GridOf<T>>(*old));
        else
          return AnyGrid(old);
      },
      grid);
}

/// The same values in the kind of grid that has this place in AnyGrid.
void widen(AnyGrid& grid, std::size_t kind) {
  if (kind == 1) make_kind<std::int16_t>(grid);
  if (kind == 2) make_kind<float>(grid);
}

/// Slices first <= k < first + depth into the grid, a leaf at a time; leaves of one value become
/// tiles. (By openvdb::tools::copyFromDense reading 512 x 512 x 300 voxels took 1.23 s, not 0.7.)
template <class Grid>
void store_leaves(Grid& grid, std::span<const float> slab, const std::array<int, 3>& size,
                  int first, int depth) {
  using Leaf = typename Grid::TreeType::LeafNodeType;
  using Value = typename Grid::ValueType;
  static_assert(Leaf::DIM == kSlab);
  const int n_rows = (size[1] + kSlab - 1) / kSlab, n_in_row = (size[0] + kSlab - 1) / kSlab;
  const std::size_t n = std::size_t(size[0]) * size[1];
  std::vector<std::unique_ptr<Leaf>> leaves(std::size_t(n_rows) * n_in_row);
  std::vector<Value> values(leaves.size());  // of those that have one value
  tbb::parallel_for(0, n_rows, [&](int row) {
    const int low_j = row * kSlab, n_j = std::min(kSlab, size[1] - low_j);
    for (int place = 0; place < n_in_row; ++place) {
      const int low_i = place * kSlab, n_i = std::min(kSlab, size[0] - low_i);
      const openvdb::Coord origin(low_i, low_j, first);
      auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), origin, Value(0), false);
      leaf->allocate();
      Value* out = leaf->buffer().data();
      const bool is_full = n_i == kSlab && n_j == kSlab && depth == kSlab;
      if (!is_full) std::fill(out, out + Leaf::SIZE, Value(0));
      const auto value0 = static_cast<Value>(slab[std::size_t(low_j) * size[0] + low_i]);
      bool is_same = is_full || value0 == Value(0);
      for (int k = 0; k < depth; ++k)
        for (int j = 0; j < n_j; ++j) {
          const float* from = slab.data() + k * n + std::size_t(low_j + j) * size[0] + low_i;
          for (int i = 0; i < n_i; ++i) {
            const auto value = static_cast<Value>(from[i]);
            is_same &= value == value0;
            out[(i * kSlab + j) * kSlab + k] = value;
          }
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
      grid.tree().addLeaf(leaves[at].release());
    else if (values[at] != Value(0))
      grid.tree().addTile(
          1, openvdb::Coord(int(at % n_in_row) * kSlab, int(at / n_in_row) * kSlab, first),
          values[at], false);
  }
}

/// OpenVDB takes matrices with entries that are far from 1 for singular.
openvdb::math::Transform::Ptr transform_of(const Eigen::Affine3d& affine, const std::string& path) {
  try {
    return openvdb::math::Transform::createLinearTransform(to_openvdb(affine));
  } catch (const openvdb::ArithmeticError&) {
    const Eigen::Vector3d spacing = affine.linear().colwise().norm();
    throw InputError(fmt::format(
        "{}: voxels of {:.3g} x {:.3g} x {:.3g} mm are too small or too thin; scale the lengths",
        path, spacing[0], spacing[1], spacing[2]));
  }
}

}  // namespace

namespace {

bool is_stored_order(const AxisOrder& order) {
  return order.axes == std::array{0, 1, 2} && order.are_reversed == std::array{false, false, false};
}

/// Where the grid has a voxel.
openvdb::Coord stored_index(const Volume::Impl& impl, const std::array<int, 3>& index) {
  openvdb::Coord out;
  for (int n = 0; n < 3; ++n)
    out[impl.order.axes[n]] = impl.order.are_reversed[n] ? impl.size[n] - 1 - index[n] : index[n];
  return out;
}

/// Voxels lower <= index < upper of the volume, i fastest.
void copy_inner_box(const Volume::Impl& impl, const std::array<int, 3>& lower,
                    const std::array<int, 3>& upper, float* out) {
  const openvdb::Coord first = stored_index(impl, lower),
                       last = stored_index(impl, {upper[0] - 1, upper[1] - 1, upper[2] - 1});
  const openvdb::CoordBBox box(openvdb::Coord::minComponent(first, last),
                               openvdb::Coord::maxComponent(first, last));
  const auto copy_to = [&](float* values) {
    Dense dense(box, values);
    std::visit(
        [&](const auto& grid) { openvdb::tools::copyToDense(*grid, dense, /*serial=*/true); },
        impl.grid);
  };
  if (is_stored_order(impl.order)) return copy_to(out);
  std::vector<float> stored(box.volume());
  copy_to(stored.data());
  const openvdb::Coord size = box.dim(), from = first - box.min();
  const std::array<std::ptrdiff_t, 3> strides = {1, size[0], std::ptrdiff_t(size[0]) * size[1]};
  std::array<std::ptrdiff_t, 3> steps;
  for (int n = 0; n < 3; ++n)
    steps[n] = strides[impl.order.axes[n]] * (impl.order.are_reversed[n] ? -1 : 1);
  const float* start = stored.data() + from[0] + from[1] * strides[1] + from[2] * strides[2];
  for (int k = 0; k < upper[2] - lower[2]; ++k)
    for (int j = 0; j < upper[1] - lower[1]; ++j) {
      const float* row = start + k * steps[2] + j * steps[1];
      for (int i = 0; i < upper[0] - lower[0]; ++i) *out++ = row[i * steps[0]];
    }
}

/// The place of voxel (0, 0, 0) by 2^-10 of a voxel's size: the floats in files' affines tell less.
Eigen::Affine3d with_rounded_origin(Eigen::Affine3d affine) {
  const double size = std::cbrt(std::abs(affine.linear().determinant()));
  const double unit = std::exp2(std::floor(std::log2(size)) - 10);
  affine.translation() = (affine.translation() / unit).array().round() * unit;
  return affine;
}

}  // namespace

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

openvdb::math::Mat4d to_openvdb(const Eigen::Affine3d& affine) {
  openvdb::math::Mat4d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result[row][column] = affine.matrix()(column, row);
  return result;
}

Eigen::Affine3d from_openvdb(const openvdb::math::Mat4d& matrix) {
  Eigen::Affine3d result;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) result.matrix()(column, row) = matrix[row][column];
  return result;
}

Volume::Volume(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Volume::Volume(const std::array<int, 3>& size, const Eigen::Affine3d& index_to_world,
               std::span<const float> values) {
  Builder builder(size, index_to_world.matrix(), {});
  const std::size_t slice = std::size_t(size[0]) * size[1];
  if (values.size() != slice * size[2])
    throw InputError(fmt::format("volume: {} values for {} x {} x {}", values.size(), size[0],
                                 size[1], size[2]));
  for (int k = 0; k < size[2]; ++k) builder.append_slice(values.subspan(k * slice, slice));
  *this = builder.finish();
}

const std::array<int, 3>& Volume::size() const { return impl_->size; }
std::size_t Volume::n_voxels() const {
  return std::size_t(impl_->size[0]) * impl_->size[1] * impl_->size[2];
}
const Eigen::Affine3d& Volume::index_to_world() const { return impl_->index_to_world; }
const Eigen::Affine3d& Volume::world_to_index() const { return impl_->world_to_index; }
Eigen::Vector3d Volume::spacing() const { return impl_->index_to_world.linear().colwise().norm(); }
double Volume::voxel_size() const {
  return std::cbrt(std::abs(impl_->index_to_world.linear().determinant()));
}
const Source& Volume::source() const { return impl_->source; }
const std::shared_ptr<const DicomOrigin>& Volume::dicom() const { return impl_->dicom; }
std::array<float, 2> Volume::range() const { return impl_->range; }
int Volume::bytes_per_voxel() const { return 1 << impl_->grid.index(); }

Volume Volume::in_ras_order() const {
  const AxisOrder order = ras_order(impl_->index_to_world);
  auto out = std::make_shared<Impl>(*impl_);
  Eigen::Affine3d to_old = Eigen::Affine3d::Identity();  // index of the old order by the new one
  to_old.linear().setZero();
  for (int n = 0; n < 3; ++n) {
    const int old = order.axes[n];
    out->size[n] = impl_->size[old];
    out->order.axes[n] = impl_->order.axes[old];
    out->order.are_reversed[n] = impl_->order.are_reversed[old] != order.are_reversed[n];
    to_old.linear()(old, n) = order.are_reversed[n] ? -1 : 1;
    if (order.are_reversed[n]) to_old.translation()[old] = impl_->size[old] - 1;
  }
  if (!is_stored_order(order)) out->dicom = nullptr;
  out->index_to_world = with_rounded_origin(impl_->index_to_world * to_old);
  out->world_to_index = out->index_to_world.inverse();
  return Volume(std::move(out));
}

float Volume::value(int i, int j, int k) const {
  const openvdb::Coord index = stored_index(*impl_, {i, j, k});
  return std::visit([&](const auto& grid) { return float(grid->tree().getValue(index)); },
                    impl_->grid);
}

void Volume::copy_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                      float* out) const {
  std::array<int, 3> inner_lower, inner_upper;  // the part inside the volume, at least one voxel
  bool is_inside = true;
  for (int axis = 0; axis < 3; ++axis) {
    inner_lower[axis] = std::clamp(lower[axis], 0, size()[axis] - 1);
    inner_upper[axis] = std::clamp(upper[axis], inner_lower[axis] + 1, size()[axis]);
    is_inside &= inner_lower[axis] == lower[axis] && inner_upper[axis] == upper[axis];
  }
  if (is_inside) {
    copy_inner_box(*impl_, inner_lower, inner_upper, out);
    return;
  }
  std::size_t n_inner = 1;
  for (int axis = 0; axis < 3; ++axis) n_inner *= inner_upper[axis] - inner_lower[axis];
  std::vector<float> inner(n_inner);
  copy_inner_box(*impl_, inner_lower, inner_upper, inner.data());
  const std::size_t stride_j = inner_upper[0] - inner_lower[0];
  const std::size_t stride_k = stride_j * (inner_upper[1] - inner_lower[1]);
  for (int k = lower[2]; k < upper[2]; ++k)
    for (int j = lower[1]; j < upper[1]; ++j)
      for (int i = lower[0]; i < upper[0]; ++i)
        *out++ =
            inner[(std::clamp(k, inner_lower[2], inner_upper[2] - 1) - inner_lower[2]) * stride_k +
                  (std::clamp(j, inner_lower[1], inner_upper[1] - 1) - inner_lower[1]) * stride_j +
                  (std::clamp(i, inner_lower[0], inner_upper[0] - 1) - inner_lower[0])];
}

namespace {

[[noreturn]] void throw_unusable(const Volume::Impl& impl, std::span<const float> slice, int k) {
  const auto at = std::size_t(
      std::find_if_not(slice.begin(), slice.end(), [](float v) { return is_usable_value(v); }) -
      slice.begin());
  throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}", impl.source.path, at % impl.size[0],
                               at / impl.size[0], k, fault_of_value(slice[at])));
}

/// The slices that end before n_slices.
void store_slab(Volume::Impl& impl, std::span<const float> slab, int n_slices) {
  const std::size_t n = std::size_t(impl.size[0]) * impl.size[1];
  const int depth = static_cast<int>(slab.size() / n), first = n_slices - depth;
  std::array<SliceValues, kSlab> all;
  tbb::parallel_for(0, depth, [&](int k) { all[k] = values_of(slab.subspan(k * n, n)); });
  std::size_t kind = impl.grid.index();
  for (int k = 0; k < depth; ++k) {
    if (!all[k].are_usable) throw_unusable(impl, slab.subspan(k * n, n), first + k);
    impl.range[0] = std::min(impl.range[0], all[k].lowest);
    impl.range[1] = std::max(impl.range[1], all[k].highest);
    kind = std::max(kind, all[k].kind);
  }
  if (const std::size_t old = impl.grid.index(); kind > old) {
    // The old and the new grid are there together.
    check_memory(
        double(1 << kind) * double(n) * impl.size[2] + double(1 << old) * double(n) * n_slices,
        kind == 1 ? " as 16-bit integers" : " as 32-bit floats", impl.size, impl.source.path);
    widen(impl.grid, kind);
  }
  std::visit([&](const auto& grid) { store_leaves(*grid, slab, impl.size, first, depth); },
             impl.grid);
}

}  // namespace

struct Volume::Builder::Storing {
  tbb::task_group task;
  std::vector<float> slab;
};

Volume::Builder::Builder(const std::array<int, 3>& size, const Eigen::Matrix4d& index_to_world,
                         Source source) {
  check_size(size, source.path);
  storing_ = std::make_unique<Storing>();
  initialize_openvdb();
  impl_ = std::make_shared<Impl>();
  impl_->size = size;
  impl_->index_to_world = checked_affine<3>(index_to_world, source.path, "voxel");
  impl_->world_to_index = impl_->index_to_world.inverse();
  impl_->source = std::move(source);
  impl_->range = {std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  const auto grid = GridOf<std::uint8_t>::create(0);
  grid->setTransform(transform_of(impl_->index_to_world, impl_->source.path));
  impl_->grid = grid;
}

Volume::Builder::~Builder() {
  try {
    if (storing_) storing_->task.wait();
  } catch (...) {  // a reader that has failed itself does not ask for more
  }
}

void Volume::Builder::append_slice(std::span<const float> values) {
  const auto& size = impl_->size;
  const std::size_t n = std::size_t(size[0]) * size[1];
  if (n_slices_ == size[2] || values.size() != n)
    throw InputError(fmt::format("{}: slice {} has {} voxels, expected {} slices of {}",
                                 impl_->source.path, n_slices_, values.size(), size[2], n));
  // Not before: a header may promise slices that the file does not hold.
  if (slab_.empty()) slab_.reserve(n * std::min(size[2] - n_slices_, kSlab));
  slab_.insert(slab_.end(), values.begin(), values.end());
  ++n_slices_;
  if (n_slices_ % kSlab != 0 && n_slices_ != size[2]) return;
  storing_->task.wait();
  storing_->slab.swap(slab_);
  slab_.clear();
  storing_->task.run([storing = storing_.get(), impl = impl_.get(), n_slices = n_slices_] {
    store_slab(*impl, storing->slab, n_slices);
  });
}

void Volume::Builder::set_dicom(DicomOrigin origin) {
  impl_->dicom = std::make_shared<const DicomOrigin>(std::move(origin));
}

Volume Volume::Builder::finish() {
  storing_->task.wait();
  if (n_slices_ != impl_->size[2])
    throw InputError(
        fmt::format("{}: {} of {} slices", impl_->source.path, n_slices_, impl_->size[2]));
  return Volume(std::move(impl_));
}

}  // namespace surf::volume
