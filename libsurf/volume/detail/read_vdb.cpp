#include "libsurf/volume/detail/read_vdb.h"

#include <fmt/format.h>
#include <openvdb/io/Stream.h>
#include <openvdb/tools/Dense.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/volume/detail/openvdb_grid.h"
#include "libsurf/volume/detail/raw_scalars.h"

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

template <class Grid>
Volume volume_of(Grid& grid, const Eigen::Affine3d& grid_to_world, Source source) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (grid.activeVoxelCount() == 0)
    throw InputError(
        fmt::format("{}: grid '{}' has no active voxels", source.path, grid.getName()));
  std::array<std::int64_t, 3> extent;
  for (int axis = 0; axis < 3; ++axis)
    extent[axis] = std::int64_t(box.max()[axis]) - box.min()[axis] + 1;
  const std::array<int, 3> size = checked_size(source.path, extent);
  check_extent(size, source.path);
  Eigen::Affine3d index_to_world = grid_to_world;
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

Eigen::Affine3d grid_to_world(const openvdb::GridBase& grid, const std::string& path) {
  if (!grid.transform().isLinear())
    throw InputError(fmt::format("{}: grid '{}' has a frustum for a transform, not an affine map",
                                 path, grid.getName()));
  return from_openvdb(grid.transform().baseMap()->getAffineMap()->getMat4());
}

bool is_scalar(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>() ||
         grid.isType<openvdb::Int32Grid>() || grid.isType<openvdb::Int64Grid>();
}

/// All grids of the file. OpenVDB reads on past the end of a truncated file, and takes what it
/// finds there for sizes; with exceptions on in the stream it cannot.
openvdb::GridPtrVecPtr read_grids(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  file.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
  return openvdb::io::Stream(file, /*delayLoad=*/false).getGrids();
}

/// The first scalar grid.
openvdb::GridBase::Ptr scalar_grid(const openvdb::GridPtrVecPtr& grids, Source& source) {
  std::string names;
  for (const auto& grid : *grids) {
    if (!grid) continue;
    if (is_scalar(*grid)) {
      if (grids->size() > 1)
        source.notes.push_back(
            fmt::format("{} grids in the file, read '{}'", grids->size(), grid->getName()));
      if (grid->getGridClass() == openvdb::GRID_LEVEL_SET)
        source.notes.emplace_back("a level set: values are distances, not intensities");
      return grid;
    }
    names += fmt::format(" '{}' ({})", grid->getName(), grid->valueType());
  }
  throw InputError(fmt::format("{}: has no scalar grid (float, double, int32, int64){}{}",
                               source.path, names.empty() ? "" : ", only", names));
}

Volume read_grid(const std::string& path) {
  Source source;
  source.path = path;
  source.format = "OpenVDB";
  source.orientation_source = "grid transform";
  source.notes.emplace_back("OpenVDB has no anatomical convention: coordinates taken as RAS mm");
  openvdb::GridPtrVecPtr grids = read_grids(path);
  const openvdb::GridBase::Ptr grid = scalar_grid(grids, source);
  grids.reset();
  const Eigen::Affine3d affine = grid_to_world(*grid, path);
  source.scalar_type = grid->valueType();
  if (source.scalar_type == "float") source.scalar_type = "float32";
  if (source.scalar_type == "double") source.scalar_type = "float64";
  if (const auto typed = openvdb::gridPtrCast<openvdb::FloatGrid>(grid))
    return volume_of(*typed, affine, std::move(source));
  if (const auto typed = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid))
    return volume_of(*typed, affine, std::move(source));
  if (const auto typed = openvdb::gridPtrCast<openvdb::Int32Grid>(grid))
    return volume_of(*typed, affine, std::move(source));
  return volume_of(*openvdb::gridPtrCast<openvdb::Int64Grid>(grid), affine, std::move(source));
}

}  // namespace

Volume read_vdb(const std::string& path, const ReadOptions& options) {
  check_frame(path, options.frame_index, 1);
  initialize_openvdb();
  try {
    return read_grid(path);
  } catch (const openvdb::Exception& error) {
    throw InputError(
        fmt::format("{}: not a readable OpenVDB file: {}; get the file again", path, error.what()));
  } catch (const std::ios::failure&) {
    throw InputError(fmt::format("{}: truncated or damaged; get the file again", path));
  }
}

}  // namespace surf::volume
