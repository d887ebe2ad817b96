#include "libsurf/volume/volume.h"

#include <fmt/format.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <type_traits>

#include "libsurf/base/affine.h"
#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/base/values.h"
#include "libsurf/volume/detail/openvdb_grid.h"

namespace surf::volume {
namespace {

constexpr int kSlab = 8;  // slices handed over at once: an OpenVDB leaf is 8^3

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>;
using ConstDense = openvdb::tools::Dense<const float, openvdb::tools::LayoutXYZ>;

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
  check_memory(slice * size[2] + sizeof(float) * slice * std::min(size[2], kSlab), " at least",
               size, path);
}

/// The least kind of grid, by its place in AnyGrid, that holds all values.
std::size_t least_kind(const std::vector<float>& values) {
  const auto are_in = [&](float lowest, float highest) {
    return std::all_of(values.begin(), values.end(), [&](float value) {  // -0 is none
      return value >= lowest && value <= highest && value == std::floor(value) &&
             !(value == 0 && std::signbit(value));
    });
  };
  return are_in(0, 255) ? 0 : are_in(-32768, 32767) ? 1 : 2;
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

Volume::Builder::Builder(const std::array<int, 3>& size, const Eigen::Matrix4d& index_to_world,
                         Source source) {
  check_size(size, source.path);
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
  slab_.reserve(std::size_t(size[0]) * size[1] * std::min(size[2], kSlab));
}

Volume::Builder::~Builder() = default;

void Volume::Builder::append_slice(std::span<const float> values) {
  const auto& size = impl_->size;
  const std::size_t n = std::size_t(size[0]) * size[1];
  if (n_slices_ == size[2] || values.size() != n)
    throw InputError(fmt::format("{}: slice {} has {} voxels, expected {} slices of {}",
                                 impl_->source.path, n_slices_, values.size(), size[2], n));
  auto& [lowest, highest] = impl_->range;
  for (std::size_t at = 0; at < n; ++at) {
    const float value = values[at];
    if (!is_usable_value(value))
      throw InputError(fmt::format("{}: voxel ({}, {}, {}) is {}", impl_->source.path, at % size[0],
                                   at / size[0], n_slices_, fault_of_value(value)));
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  slab_.insert(slab_.end(), values.begin(), values.end());
  ++n_slices_;
  if (n_slices_ % kSlab == 0 || n_slices_ == size[2]) store_slab();
}

void Volume::Builder::store_slab() {
  const auto& size = impl_->size;
  const std::size_t old = impl_->grid.index();
  if (const std::size_t kind = old == 2 ? old : least_kind(slab_); kind > old) {
    const double slice = double(size[0]) * size[1];  // the old and the new grid are there together
    check_memory(double(1 << kind) * slice * size[2] + double(1 << old) * slice * n_slices_,
                 kind == 1 ? " as 16-bit integers" : " as 32-bit floats", size, impl_->source.path);
    widen(impl_->grid, kind);
  }
  const int depth = static_cast<int>(slab_.size() / (std::size_t(size[0]) * size[1]));
  const openvdb::CoordBBox box(openvdb::Coord(0, 0, n_slices_ - depth),
                               openvdb::Coord(size[0] - 1, size[1] - 1, n_slices_ - 1));
  const ConstDense dense(box, slab_.data());
  std::visit(
      [&](const auto& grid) {
        using Value = typename std::decay_t<decltype(*grid)>::ValueType;
        openvdb::tools::copyFromDense(dense, *grid, /*tolerance=*/Value(0));
      },
      impl_->grid);
  slab_.clear();
}

void Volume::Builder::set_dicom(DicomOrigin origin) {
  impl_->dicom = std::make_shared<const DicomOrigin>(std::move(origin));
}

Volume Volume::Builder::finish() {
  if (n_slices_ != impl_->size[2])
    throw InputError(
        fmt::format("{}: {} of {} slices", impl_->source.path, n_slices_, impl_->size[2]));
  return Volume(std::move(impl_));
}

}  // namespace surf::volume
