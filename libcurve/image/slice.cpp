#include "libcurve/image/slice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/volume/interpolate.h"
#include "libsurf/volume/orientation.h"

namespace surf::curve {
namespace {

using Eigen::Vector3d;

/// Letters a volume's index axis may run to, and the one that columns and rows shall run to.
struct View {
  const char* name;
  std::array<const char*, 3> sides;  ///< of columns, rows and across
  std::array<char, 2> towards;
};

const View& view_of(SlicePlane plane) {
  static const std::array<View, 3> kViews = {{{"axial", {"LR", "AP", "SI"}, {'L', 'P'}},
                                              {"sagittal", {"AP", "SI", "LR"}, {'P', 'I'}},
                                              {"coronal", {"LR", "SI", "AP"}, {'L', 'I'}}}};
  return kViews[static_cast<int>(plane)];
}

/// The plane's frame: x along the columns, y as nearly along the rows as the right angle allows.
Eigen::Affine3d plane_frame(const Vector3d& origin, const Vector3d& column, const Vector3d& row) {
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  const Vector3d x = column.normalized();
  const Vector3d y = (row - row.dot(x) * x).normalized();
  out.linear().col(0) = x;
  out.linear().col(1) = y;
  out.linear().col(2) = x.cross(y);
  out.translation() = origin;
  return out;
}

/// Range of the plane coordinates of the volume's box cut by the plane.
std::optional<std::array<Eigen::Vector2d, 2>> cut_box(const volume::Volume& volume,
                                                      const Eigen::Affine3d& frame) {
  const auto& size = volume.size();
  std::array<Vector3d, 8> corner;
  const Eigen::Affine3d to_frame = frame.inverse() * volume.index_to_world();
  for (int n = 0; n < 8; ++n)
    corner[n] = to_frame *
                Vector3d(n & 1 ? size[0] - 1 : 0, n & 2 ? size[1] - 1 : 0, n & 4 ? size[2] - 1 : 0);
  Eigen::AlignedBox2d box;
  for (int n = 0; n < 8; ++n)
    for (const int bit : {1, 2, 4}) {
      if ((n & bit) != 0) continue;
      const Vector3d &a = corner[n], &b = corner[n | bit];
      if ((a[2] > 0) == (b[2] > 0) && a[2] != 0 && b[2] != 0) continue;
      const double t = a[2] == b[2] ? 0 : a[2] / (a[2] - b[2]);
      box.extend(Eigen::Vector2d((a + t * (b - a)).head<2>()));
      if (a[2] == 0 && b[2] == 0) box.extend(Eigen::Vector2d(b.head<2>()));
    }
  if (box.isEmpty()) return std::nullopt;
  return std::array<Eigen::Vector2d, 2>{box.min(), box.max()};
}

/// @param indices  within the volume
std::vector<float> values_at(const volume::Volume& volume, const std::vector<Vector3d>& indices,
                             BetweenVoxels between) {
  std::vector<float> out;
  if (between == BetweenVoxels::kLinear) {
    const std::vector<double> values = volume::interpolate(volume, indices);
    out.assign(values.begin(), values.end());
    return out;
  }
  out.reserve(indices.size());
  for (const Vector3d& index : indices) {
    const Eigen::Array3i voxel = index.array().round().cast<int>();
    out.push_back(volume.value(voxel[0], voxel[1], voxel[2]));
  }
  return out;
}

ImageSource source_of(const volume::Volume& volume, const std::string& which) {
  ImageSource source;
  source.path = volume.source().path;
  source.format = fmt::format("{}, {}", volume.source().format, which);
  source.scalar_type = volume.source().scalar_type;
  source.spacing_source = "volume";
  source.notes = volume.source().notes;
  return source;
}

}  // namespace

VoxelSlices::VoxelSlices(const volume::Volume& volume, SlicePlane plane)
    : volume_(volume), plane_(plane) {
  const std::string code = volume::orientation_of(volume.index_to_world()).code;
  const View& view = view_of(plane);
  for (int n = 0; n < 3; ++n) {
    axis_[n] = static_cast<int>(code.find_first_of(view.sides[n]));
    if (n < 2) is_turned_[n] = code[axis_[n]] != view.towards[n];
  }
}

std::array<int, 3> VoxelSlices::voxel(int i, int j, int k) const {
  std::array<int, 3> out{};
  out[axis_[0]] = is_turned_[0] ? volume_.size()[axis_[0]] - 1 - i : i;
  out[axis_[1]] = is_turned_[1] ? volume_.size()[axis_[1]] - 1 - j : j;
  out[axis_[2]] = k;
  return out;
}

int VoxelSlices::nearest(const Vector3d& point_ras_mm) const {
  const Vector3d index = volume_.world_to_index() * point_ras_mm;
  return static_cast<int>(std::lround(index[axis_[2]]));
}

Image VoxelSlices::slice(int k) const {
  const View& view = view_of(plane_);
  if (k < 0 || k >= n_slices())
    throw InputError(fmt::format("{}: there is no {} slice {}; they are 0 to {}",
                                 volume_.source().path, view.name, k, n_slices() - 1));
  const std::array<int, 2> size = {volume_.size()[axis_[0]], volume_.size()[axis_[1]]};
  const auto world = [&](int i, int j) -> Vector3d {
    const auto index = voxel(i, j, k);
    return volume_.index_to_world() * Vector3d(index[0], index[1], index[2]);
  };
  const Vector3d origin = world(0, 0), column = world(1, 0) - origin, row = world(0, 1) - origin;
  const Eigen::Affine3d frame = plane_frame(origin, column, row);
  Eigen::Affine2d to_plane = Eigen::Affine2d::Identity();
  to_plane.linear().col(0) = (frame.linear().transpose() * column).head<2>();
  to_plane.linear().col(1) = (frame.linear().transpose() * row).head<2>();
  // From plane to plane; less than the spacing where the grid is sheared.
  const double thickness =
      std::abs(frame.linear().col(2).dot(volume_.index_to_world().linear().col(axis_[2])));
  std::vector<float> values;
  values.reserve(std::size_t(size[0]) * size[1]);
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      const auto index = voxel(i, j, k);
      values.push_back(volume_.value(index[0], index[1], index[2]));
    }
  return Image(size, to_plane, std::move(values),
               source_of(volume_, fmt::format("{} slice {}", view.name, k)), frame, thickness);
}

Image oblique_slice(const volume::Volume& volume, const Vector3d& point_ras_mm,
                    const Vector3d& normal, std::optional<double> spacing_mm,
                    BetweenVoxels between) {
  if (!(normal.norm() > 0) || !normal.allFinite() || !point_ras_mm.allFinite())
    throw UsageError("a plane needs a finite point and a normal that is not 0");
  const double spacing = spacing_mm.value_or(volume.voxel_size());
  const Vector3d n = normal.normalized();
  const Vector3d down = std::abs(n[2]) > 0.9 ? Vector3d(0, -1, 0) : Vector3d(0, 0, -1);
  const Vector3d row = (down - down.dot(n) * n).normalized();
  // Seen so that columns run to the patient's left, or to the back.
  Vector3d column = row.cross(n);
  if (column[0] > 1e-9 || (std::abs(column[0]) <= 1e-9 && column[1] > 0)) column = -column;
  Eigen::Affine3d frame = plane_frame(point_ras_mm, column, row);
  const auto cut = cut_box(volume, frame);
  if (!cut)
    throw UsageError(fmt::format("the plane through {:g},{:g},{:g} (RAS mm) misses the volume",
                                 point_ras_mm[0], point_ras_mm[1], point_ras_mm[2]));
  const auto& [lower, upper] = *cut;
  frame.translation() = frame * Vector3d(lower[0], lower[1], 0);
  const auto n_pixels = [&, lower = lower, upper = upper](int axis) {
    return static_cast<long long>(std::floor((upper[axis] - lower[axis]) / spacing + 1e-6)) + 1;
  };
  check_image_size({n_pixels(0), n_pixels(1)}, volume.source().path);
  const std::array<int, 2> size = {int(n_pixels(0)), int(n_pixels(1))};
  const Vector3d last(volume.size()[0] - 1, volume.size()[1] - 1, volume.size()[2] - 1);
  std::vector<Vector3d> indices;
  indices.reserve(std::size_t(size[0]) * size[1]);
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      const Vector3d index =
          volume.world_to_index() * (frame * Vector3d(spacing * i, spacing * j, 0));
      indices.push_back(index.cwiseMax(0.0).cwiseMin(last));
    }
  return Image(size, pixel_to_plane({spacing, spacing}), values_at(volume, indices, between),
               source_of(volume, "oblique plane"), frame, spacing);
}

Segments carried(const Segments& curves, const Eigen::Affine3d& from, const Eigen::Affine3d& to) {
  if (from.matrix() == to.matrix()) return curves;  // to the bit
  Segments out = curves;
  const Eigen::Affine3d map = to.inverse() * from;
  for (auto point : out.points.rowwise()) {
    const Vector3d in(point[0], point[1], 0);
    point = (map * in).head<2>().transpose();
  }
  if (map.linear().topLeftCorner<2, 2>().determinant() < 0)  // seen from behind
    out.elements.col(0).swap(out.elements.col(1));
  return out;
}

PlaneOffset plane_offset(const Segments& curves, const Eigen::Affine3d& from,
                         const Eigen::Affine3d& to) {
  const Eigen::Affine3d map = to.inverse() * from;
  PlaneOffset out;
  for (const auto point : curves.points.rowwise())
    out.most_mm = std::max(out.most_mm, std::abs((map * Vector3d(point[0], point[1], 0))[2]));
  const Vector3d a = from.linear().col(0).cross(from.linear().col(1)),
                 b = to.linear().col(0).cross(to.linear().col(1));
  out.angle_deg = std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / M_PI;
  return out;
}

}  // namespace surf::curve
