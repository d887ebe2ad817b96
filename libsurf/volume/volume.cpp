#include "libsurf/volume/volume.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "libsurf/base/affine.h"
#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"
#include "libsurf/base/memory.h"
#include "libsurf/base/values.h"
#include "libsurf/volume/detail/block_means.h"
#include "libsurf/volume/detail/voxel_grid.h"
#include "libsurf/volume/orientation.h"

namespace surf::volume {
namespace {

/// Of values that are stored wider than the floats they become, where these are coarse beside
/// their range, as those of a small contrast on a large offset; empty if they are not.
std::string note_of_rounding(const Source& source, const std::array<float, 2>& range) {
  constexpr double kCoarse = 1e-3, kFloat = 6e-8;  // of the range; of a value
  constexpr double kWholeNumbers = 0.5;            // where all have become one
  const bool is_wide = source.scalar_type == "float64" || source.scalar_type.ends_with("int32") ||
                       source.scalar_type.ends_with("int64");
  const double width = double(range[1]) - range[0],
               rounding = kFloat * std::max(std::abs(double(range[0])), std::abs(double(range[1])));
  const bool is_coarse = width > 0 ? rounding > kCoarse * width : rounding > kWholeNumbers;
  if (!is_wide || !is_coarse) return {};
  return fmt::format(
      "{} values become 32-bit floats, which are up to {:.2g} off here, of a range of {:.4g}; take "
      "off the offset that they have in common",
      source.scalar_type, rounding, width);
}

/// In messages; what was made of an array has no path.
std::string name_of(const Source& source) {
  return source.path.empty() ? std::string("the volume") : source.path;
}

constexpr int kSlab = VoxelGrid::kSlab;

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
  int bytes_per_voxel = 1;  ///< the fewest of a VoxelGrid that holds them
};

/// None is the negative zero, either; all are within what an int holds.
bool are_whole(const Eigen::Map<const Eigen::ArrayXf>& values) {
  constexpr float kNegativeZero = -0.0f;
  const Eigen::Map<const Eigen::ArrayXi> bits(reinterpret_cast<const int*>(values.data()),
                                              values.size());
  return (values - values.cast<int>().cast<float>()).abs().maxCoeff() == 0 &&
         bits.minCoeff() != std::bit_cast<int>(kNegativeZero);
}

SliceValues values_of(std::span<const float> values) {
  constexpr std::size_t kBlock = 4096;  // that a cache holds while it is looked at thrice
  SliceValues out;
  bool is_whole = true;
  for (std::size_t at = 0; at < values.size(); at += kBlock) {
    const Eigen::Map<const Eigen::ArrayXf> block(
        values.data() + at, Eigen::Index(std::min(kBlock, values.size() - at)));
    const float lowest = block.minCoeff<Eigen::PropagateNaN>(),
                highest = block.maxCoeff<Eigen::PropagateNaN>();
    out.are_usable &= is_usable_value(lowest) && is_usable_value(highest);
    out.lowest = std::min(out.lowest, lowest);
    out.highest = std::max(out.highest, highest);
    is_whole = is_whole && lowest >= -32768 && highest <= 32767 && are_whole(block);
  }
  if (!is_whole)
    out.bytes_per_voxel = 4;
  else if (out.lowest < 0 || out.highest > 255)
    out.bytes_per_voxel = 2;
  return out;
}

[[noreturn]] void throw_unusable(std::span<const float> slice, const std::array<int, 3>& size,
                                 int k, const std::string& path) {
  const auto at = std::size_t(
      std::find_if_not(slice.begin(), slice.end(), [](float v) { return is_usable_value(v); }) -
      slice.begin());
  throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}", path.empty() ? "array" : path,
                               at % size[0], at / size[0], k, fault_of_value(slice[at])));
}

/// The other maps were never tried on smaller voxels; one of 14 nm is this large.
void check_voxel_size(const Eigen::Affine3d& affine, const std::string& path) {
  if (std::abs(affine.linear().determinant()) > 3e-15) return;
  const Eigen::Vector3d spacing = affine.linear().colwise().norm();
  throw InputError(fmt::format(
      "{}: voxels of {:.3g} x {:.3g} x {:.3g} mm are too small or too thin; scale the lengths",
      path, spacing[0], spacing[1], spacing[2]));
}

bool is_stored_order(const AxisOrder& order) {
  return order.axes == std::array{0, 1, 2} && order.are_reversed == std::array{false, false, false};
}

/// The place of voxel (0, 0, 0) by 2^-10 of a voxel's size: the floats in files' affines tell less.
Eigen::Affine3d with_rounded_origin(Eigen::Affine3d affine) {
  const double size = std::cbrt(std::abs(affine.linear().determinant()));
  const double unit = std::exp2(std::floor(std::log2(size)) - 10);
  affine.translation() = (affine.translation() / unit).array().round() * unit;
  return affine;
}

}  // namespace

struct Volume::Impl {
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;
  Eigen::Affine3d world_to_index;
  Source source;
  std::shared_ptr<const DicomOrigin> dicom = {};
  std::array<float, 2> range;
  /// The voxels as they were read, at (i, j, k) of the index in that order of the axes.
  std::shared_ptr<VoxelGrid> grid;
  /// Index axis n runs along axis order.axes[n] of the grid, or against it.
  AxisOrder order = {};
  std::shared_ptr<const Impl> coarser = {};

  std::array<int, 3> stored_index(const std::array<int, 3>& index) const;
  void copy_inner_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                      float* out) const;
  void store_slab(std::span<const float> slab, int n_slices);
};

/// Where the grid has a voxel.
std::array<int, 3> Volume::Impl::stored_index(const std::array<int, 3>& index) const {
  std::array<int, 3> out;
  for (int n = 0; n < 3; ++n)
    out[order.axes[n]] = order.are_reversed[n] ? size[n] - 1 - index[n] : index[n];
  return out;
}

/// Voxels lower <= index < upper of the volume, i fastest.
void Volume::Impl::copy_inner_box(const std::array<int, 3>& lower, const std::array<int, 3>& upper,
                                  float* out) const {
  if (is_stored_order(order)) return grid->copy_box(lower, upper, out);
  const std::array<int, 3> from = stored_index(lower),
                           last = stored_index({upper[0] - 1, upper[1] - 1, upper[2] - 1});
  std::array<int, 3> box_lower, box_upper;
  std::array<std::ptrdiff_t, 4> strides = {1};  // of the box as it is stored, and its voxels
  for (int axis = 0; axis < 3; ++axis) {
    box_lower[axis] = std::min(from[axis], last[axis]);
    box_upper[axis] = std::max(from[axis], last[axis]) + 1;
    strides[axis + 1] = strides[axis] * (box_upper[axis] - box_lower[axis]);
  }
  std::vector<float> stored(static_cast<std::size_t>(strides[3]));
  grid->copy_box(box_lower, box_upper, stored.data());
  const float* start = stored.data();
  std::array<std::ptrdiff_t, 3> steps;
  for (int n = 0; n < 3; ++n) {
    start += (from[n] - box_lower[n]) * strides[n];
    steps[n] = strides[order.axes[n]] * (order.are_reversed[n] ? -1 : 1);
  }
  for (int k = 0; k < upper[2] - lower[2]; ++k)
    for (int j = 0; j < upper[1] - lower[1]; ++j) {
      const float* row = start + k * steps[2] + j * steps[1];
      for (int i = 0; i < upper[0] - lower[0]; ++i) *out++ = row[i * steps[0]];
    }
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
int Volume::bytes_per_voxel() const { return impl_->grid->bytes_per_voxel(); }
std::optional<Volume> Volume::coarser() const {
  if (!impl_->coarser) return std::nullopt;
  return Volume(impl_->coarser);
}

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
  if (impl_->coarser) out->coarser = Volume(impl_->coarser).in_ras_order().impl_;
  return Volume(std::move(out));
}

float Volume::value(int i, int j, int k) const {
  return impl_->grid->value(impl_->stored_index({i, j, k}));
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
    impl_->copy_inner_box(inner_lower, inner_upper, out);
    return;
  }
  std::size_t n_inner = 1;
  for (int axis = 0; axis < 3; ++axis) n_inner *= inner_upper[axis] - inner_lower[axis];
  std::vector<float> inner(n_inner);
  impl_->copy_inner_box(inner_lower, inner_upper, inner.data());
  const auto inner_box = IndexBox<3>::between(inner_lower, inner_upper);
  const auto within = [&](int index, int axis) {
    return std::clamp(index, inner_lower[axis], inner_upper[axis] - 1);
  };
  // Of a row those before the inner part, in it, and after it.
  const int n_before = std::clamp(inner_lower[0] - lower[0], 0, upper[0] - lower[0] - 1),
            n_after = std::clamp(upper[0] - inner_upper[0], 0, upper[0] - lower[0] - 1),
            n_within = upper[0] - lower[0] - n_before - n_after;
  for (int k = lower[2]; k < upper[2]; ++k)
    for (int j = lower[1]; j < upper[1]; ++j) {
      const float* row = &inner[inner_box.at({inner_lower[0], within(j, 1), within(k, 2)})];
      out = std::fill_n(out, n_before, row[0]);
      out = std::copy_n(row, n_within, out);
      out = std::fill_n(out, n_after, row[inner_box.size[0] - 1]);
    }
}

/// The slices that end before n_slices.
void Volume::Impl::store_slab(std::span<const float> slab, int n_slices) {
  const std::size_t n = std::size_t(size[0]) * size[1];
  const int depth = static_cast<int>(slab.size() / n), first = n_slices - depth;
  std::array<SliceValues, kSlab> all;
  tbb::parallel_for(0, depth, [&](int k) { all[k] = values_of(slab.subspan(k * n, n)); });
  const int old = grid->bytes_per_voxel();
  int needed = old;
  for (int k = 0; k < depth; ++k) {
    if (!all[k].are_usable)
      throw_unusable(slab.subspan(k * n, n), size, first + k, name_of(source));
    range[0] = std::min(range[0], all[k].lowest);
    range[1] = std::max(range[1], all[k].highest);
    needed = std::max(needed, all[k].bytes_per_voxel);
  }
  if (needed > old) {
    // The old and the new grid are there together.
    check_memory(double(needed) * double(n) * size[2] + double(old) * double(n) * n_slices,
                 needed == 2 ? " as 16-bit integers" : " as 32-bit floats", size, name_of(source));
    grid->widen(needed);
  }
  grid->store_slab(slab, first);
}

struct Volume::Builder::Storing {
  tbb::task_group task;
  std::vector<float> slab;
  std::optional<BlockMeans> means = {};

  void store(Impl& volume, int n_slices);
};

void Volume::Builder::Storing::store(Impl& volume, int n_slices) {
  volume.store_slab(slab, n_slices);
  const int first = n_slices - int(slab.size() / (std::size_t(volume.size[0]) * volume.size[1]));
  if (first == 0)
    if (const auto block = block_size(volume.size, volume.index_to_world))
      means.emplace(volume.size, volume.index_to_world, *block, volume.source);
  if (means) means->add(slab, first);
}

Volume::Builder::Builder(const std::array<int, 3>& size, const Eigen::Matrix4d& index_to_world,
                         Source source) {
  check_size(size, name_of(source));
  storing_ = std::make_unique<Storing>();
  impl_ = std::make_shared<Impl>();
  impl_->size = size;
  impl_->index_to_world = checked_affine<3>(index_to_world, name_of(source), "voxel");
  impl_->world_to_index = impl_->index_to_world.inverse();
  impl_->source = std::move(source);
  impl_->range = {std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  check_voxel_size(impl_->index_to_world, name_of(impl_->source));
  impl_->grid = SURF_LATE(surf_vdb, surf_make_voxel_grid)(size);
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
                                 name_of(impl_->source), n_slices_, values.size(), size[2], n));
  // Not before: a header may promise slices that the file does not hold.
  if (slab_.empty()) slab_.reserve(n * std::min(size[2] - n_slices_, kSlab));
  slab_.insert(slab_.end(), values.begin(), values.end());
  ++n_slices_;
  if (n_slices_ % kSlab != 0 && n_slices_ != size[2]) return;
  storing_->task.wait();
  storing_->slab.swap(slab_);
  slab_.clear();
  storing_->task.run([storing = storing_.get(), impl = impl_.get(), n_slices = n_slices_] {
    storing->store(*impl, n_slices);
  });
}

void Volume::Builder::set_dicom(DicomOrigin origin) {
  impl_->dicom = std::make_shared<const DicomOrigin>(std::move(origin));
}

Volume Volume::Builder::finish() {
  storing_->task.wait();
  if (n_slices_ != impl_->size[2])
    throw InputError(
        fmt::format("{}: {} of {} slices", name_of(impl_->source), n_slices_, impl_->size[2]));
  if (storing_->means) impl_->coarser = storing_->means->finish().impl_;
  if (const std::string note = note_of_rounding(impl_->source, impl_->range); !note.empty())
    impl_->source.notes.push_back(note);
  return Volume(std::move(impl_));
}

}  // namespace surf::volume
