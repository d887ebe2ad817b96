#include "libsurf/volume/detail/read_vdb.h"

#include <fmt/format.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/volume/detail/raw_scalars.h"
#include "libsurf/volume/detail/vdb_grid.h"

namespace surf::volume {
namespace {

constexpr int kSlab = 8;  // slices copied at once: an OpenVDB leaf is 8^3

/// Frees the leaves of the box that lie below z + 1, so that source and copy need not be in
/// memory together.
template <class Grid>
void forget(Grid& grid, const openvdb::CoordBBox& box, int z) {
  constexpr int kMask = ~(kSlab - 1);
  const openvdb::Coord lower(box.min().x() & kMask, box.min().y() & kMask, box.min().z() & kMask);
  const openvdb::Coord upper(box.max().x() | ~kMask, box.max().y() | ~kMask, ((z + 1) & kMask) - 1);
  if (upper.z() > lower.z())
    grid.tree().fill(openvdb::CoordBBox(lower, upper), grid.background(), /*active=*/false);
}

/// Two voxels of a grid may be a million apart; the box between them is believed as far as the file
/// bears it out.
void check_extent(const std::array<int, 3>& size, const std::string& path) {
  const double n_voxels = double(size[0]) * size[1] * size[2];
  std::error_code status;
  const auto n_bytes = double(std::filesystem::file_size(path, status));
  if (status || is_borne_out(n_voxels * double(sizeof(float)), n_bytes)) return;
  throw InputError(fmt::format(
      "{}: its active voxels span {} x {} x {}, the file has {:.0f} bytes: damaged, or too sparse "
      "for a volume; get the file again or clip the grid",
      path, size[0], size[1], size[2], n_bytes));
}

/// OpenVDB's loops over voxels do not end at the largest index that there is.
void check_place(const openvdb::CoordBBox& box, const std::string& path) {
  constexpr int kFarthest = 1 << 30;
  for (int axis = 0; axis < 3; ++axis)
    if (box.min()[axis] < -kFarthest || box.max()[axis] > kFarthest)
      throw InputError(
          fmt::format("{}: has active voxels at index {} and {}, beyond 2^30: damaged; "
                      "get the file again",
                      path, box.min()[axis], box.max()[axis]));
}

template <class Grid>
Volume volume_of(Grid& grid, const VdbGrid& file, Source source) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (grid.activeVoxelCount() == 0)
    throw InputError(fmt::format("{}: grid '{}' has no active voxels", source.path, file.name));
  check_place(box, source.path);
  std::array<std::int64_t, 3> extent;
  for (int axis = 0; axis < 3; ++axis)
    extent[axis] = std::int64_t(box.max()[axis]) - box.min()[axis] + 1;
  const std::array<int, 3> size = checked_size(source.path, extent);
  check_extent(size, source.path);
  Eigen::Affine3d index_to_world = file.index_to_world;
  index_to_world.translate(Eigen::Vector3d(box.min().x(), box.min().y(), box.min().z()));

  using Value = typename Grid::ValueType;
  Volume::Builder builder(size, index_to_world.matrix(), std::move(source));
  const std::size_t n_values = std::size_t(size[0]) * size[1];
  std::vector<Value> slab(n_values * std::size_t(std::min(kSlab, size[2])));
  std::vector<float> slice(n_values);
  for (int k = 0; k < size[2]; k += kSlab) {
    const int end = std::min(k + kSlab, size[2]);
    const openvdb::CoordBBox part(
        box.min().offsetBy(0, 0, k),
        openvdb::Coord(box.max().x(), box.max().y(), box.min().z() + end - 1));
    openvdb::tools::Dense<Value, openvdb::tools::LayoutXYZ> dense(part, slab.data());
    openvdb::tools::copyToDense(grid, dense);
    for (int n = 0; n < end - k; ++n) {
      std::transform(slab.begin() + n * n_values, slab.begin() + (n + 1) * n_values, slice.begin(),
                     [](Value value) { return static_cast<float>(value); });
      builder.append_slice(slice);
    }
    forget(grid, box, part.max().z());
  }
  return builder.finish();
}

Source source_of(const std::string& path, const VdbGrid& grid) {
  Source out;
  out.path = path;
  out.format = "OpenVDB";
  out.scalar_type = grid.scalar_type;
  out.orientation_source = "grid transform";
  out.notes.emplace_back("OpenVDB has no anatomical convention: coordinates taken as RAS mm");
  if (grid.n_grids > 1)
    out.notes.push_back(fmt::format("{} grids in the file, read '{}'", grid.n_grids, grid.name));
  if (grid.is_level_set)
    out.notes.emplace_back("a level set: values are distances, not intensities");
  return out;
}

Volume read_vdb(const std::string& path, const ReadOptions& options) {
  check_frame(path, options.frame_index, 1);
  const VdbGrid grid = read_vdb_grid(path);
  return std::visit(
      [&](const auto& typed) { return volume_of(*typed, grid, source_of(path, grid)); }, grid.grid);
}

}  // namespace

extern "C" {
Volume (*const surf_read_vdb)(const std::string&, const ReadOptions&) = read_vdb;
}

}  // namespace surf::volume
