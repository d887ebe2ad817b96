#include "libsurf/io/slices.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/io/detail/slice_view.h"
#include "libsurf/io/draw.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/volume/orientation.h"

namespace surf::io {
namespace {

using detail::kBackground;
using detail::kViews;
using detail::SliceView;
using detail::View;
using Box = Eigen::AlignedBox3d;

constexpr int kGap = 6;              // pixels between slices
constexpr double kMarkMargin = 0.2;  // of that round the surface

Box box_of(const volume::Volume& volume) {
  const auto [lower, upper] = volume::bounds_ras_mm(volume.index_to_world(), volume.size());
  return {lower, upper};
}

/// Of the triangles: a file may hold more points.
Box box_of(const Triangles& surface) {
  Box box;
  for (const auto element : surface.elements.rowwise())
    for (const int vertex : element) box.extend(Vector<3>(surface.points.row(vertex)));
  return box;
}

/// Half the extent of a voxel along a world axis.
double half_voxel(const volume::Volume& volume, int axis) {
  return 0.5 * volume.index_to_world().linear().row(axis).cwiseAbs().sum();
}

/// Where slices through the point are cut. Clicks and surfaces may lie as far out as the border
/// voxels' faces, values only reach to their centres.
Vector<3> cut_at(const Vector<3>& point, const volume::Volume& volume) {
  constexpr double kRounding = 1e-6;  // of half a voxel
  const Box whole = box_of(volume);
  Vector<3> margin;
  for (int axis = 0; axis < 3; ++axis) margin[axis] = (1 + kRounding) * half_voxel(volume, axis);
  if (!Box(whole.min() - margin, whole.max() + margin).contains(point))
    throw UsageError(fmt::format(
        "slices through {:.1f},{:.1f},{:.1f} mm (RAS) miss the volume; are the surface and the "
        "volume of the same scan and space?",
        point[0], point[1], point[2]));
  return point.cwiseMax(whole.min()).cwiseMin(whole.max());
}

/// What is shown: box and margin, as far as the volume goes.
/// @param center  in the volume
Box shown_box(const Triangles& surface, const std::vector<Mark>& marks,
              const volume::Volume& volume, const Vector<3>& center) {
  Box box = box_of(surface).extend(center);
  const Vector<3> margin = Vector<3>::Constant(0.5 * box.sizes().maxCoeff());
  box = Box(box.min() - margin, box.max() + margin);
  for (const Mark& mark : marks) {
    box.extend(mark.point_ras_mm - kMarkMargin * margin);
    box.extend(mark.point_ras_mm + kMarkMargin * margin);
  }
  return box.intersection(box_of(volume));
}

void check(int width, const std::optional<std::array<double, 2>>& window) {
  constexpr int kMinWidth = 100, kMaxWidth = 20000;
  if (width < kMinWidth || width > kMaxWidth)
    throw UsageError(fmt::format("SliceOptions::width: expected {} to {} pixels; got {}", kMinWidth,
                                 kMaxWidth, width));
  if (window && !((*window)[0] < (*window)[1]))
    throw UsageError(
        fmt::format("SliceOptions::window: the first value must be less than the second; got {},{}",
                    (*window)[0], (*window)[1]));
}

/// The slices' pictures in one grey scale.
std::vector<Picture> draw_all(const std::vector<SliceView>& slices, const volume::Volume& volume,
                              const std::optional<std::array<double, 2>>& window) {
  std::vector<std::vector<double>> values;
  std::vector<double> all;
  for (const SliceView& slice : slices) {
    values.push_back(slice.sample(volume));
    if (!window) all.insert(all.end(), values.back().begin(), values.back().end());
  }
  const auto range = window ? *window : automatic_window(std::move(all));
  std::vector<Picture> out;
  for (std::size_t i = 0; i < slices.size(); ++i) out.push_back(slices[i].draw(values[i], range));
  return out;
}

void check_sheet(const SheetOptions& options) {
  constexpr int kMostSlices = 400, kLeastPixels = 32;
  check(options.width, options.window);
  if (options.n_slices < 1 || options.n_slices > kMostSlices)
    throw UsageError(fmt::format("SheetOptions::n_slices = {}: expected 1 to {}", options.n_slices,
                                 kMostSlices));
  if (options.columns < 1)
    throw UsageError(fmt::format("SheetOptions::columns = {} violates >= 1", options.columns));
  if ((options.width + kGap) / options.columns - kGap < kLeastPixels)
    throw UsageError(
        fmt::format("SheetOptions::columns = {}: too many for a picture of {} pixels; a slice "
                    "needs {}",
                    options.columns, options.width, kLeastPixels));
}

/// Where slice n of a sheet cuts the axis: in the middle of its share of the surface's extent.
double place_of(int n, int n_slices, double lower, double upper) {
  return upper - (n + 0.5) / n_slices * (upper - lower);
}

/// The marks that lie next to slice n, those before the first and beyond the last one too.
std::vector<Mark> marks_of_slice(int n, const SheetOptions& options, double lower, double upper) {
  const int axis = kViews[static_cast<int>(options.plane)].normal;
  const int n_slices = options.n_slices;
  std::vector<Mark> out;
  for (const Mark& mark : options.marks) {
    const double share =
        upper > lower ? (upper - mark.point_ras_mm[axis]) / (upper - lower) * n_slices : 0;
    if (std::clamp(int(std::floor(share)), 0, n_slices - 1) == n) out.push_back(mark);
  }
  return out;
}

}  // namespace

Picture draw_slices(const Triangles& surface, const volume::Volume& volume,
                    const SliceOptions& options) {
  check(options.width, options.window);
  const Vector<3> center = cut_at(options.center_ras_mm.value_or(mesh::centroid(surface)), volume);
  const Box box = shown_box(surface, options.marks, volume, center);
  double total_mm = 0;
  for (const View& view : kViews) total_mm += box.sizes()[view.across];
  const double mm_per_pixel = total_mm / (options.width - 2 * kGap);

  std::vector<SliceView> slices;
  int width = 2 * kGap, height = 0;
  for (const View& view : kViews) {
    slices.emplace_back(view, box, center, mm_per_pixel);
    width += slices.back().width();
    height = std::max(height, slices.back().height());
  }
  std::vector<Picture> tiles = draw_all(slices, volume, options.window);
  Picture picture(width, height, kBackground);
  int x = 0;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    slices[i].draw_outline(tiles[i], surface);
    slices[i].draw_marks(tiles[i], options.marks, {half_voxel(volume, kViews[i].normal), true});
    slices[i].draw_sides(tiles[i]);
    slices[i].draw_place(tiles[i]);
    picture.paste(tiles[i], x, (height - slices[i].height()) / 2);
    x += slices[i].width() + kGap;
  }
  return picture;
}

Picture draw_sheet(const Triangles& surface, const volume::Volume& volume,
                   const SheetOptions& options) {
  check_sheet(options);
  const View& view = kViews[static_cast<int>(options.plane)];
  Vector<3> center = cut_at(mesh::centroid(surface), volume);
  const Box box = shown_box(surface, options.marks, volume, center);
  const int n_pixels = (options.width + kGap) / options.columns - kGap;  // of one slice
  const double mm_per_pixel = box.sizes()[view.across] / n_pixels;
  const int n_slices = options.n_slices, rows = (n_slices + options.columns - 1) / options.columns;
  const Box whole = box_of(volume), around = box_of(surface);
  const double first = whole.min()[view.normal], last = whole.max()[view.normal];
  const double lower = std::clamp(around.min()[view.normal], first, last);
  const double upper = std::clamp(around.max()[view.normal], first, last);

  std::vector<SliceView> slices;
  for (int n = 0; n < n_slices; ++n) {
    center[view.normal] = place_of(n, n_slices, lower, upper);
    slices.emplace_back(view, box, center, mm_per_pixel);
  }
  std::vector<Picture> tiles = draw_all(slices, volume, options.window);
  const int width = slices[0].width() + kGap, height = slices[0].height() + kGap;
  Picture picture(options.columns * width - kGap, rows * height - kGap, kBackground);
  for (int n = 0; n < n_slices; ++n) {
    slices[n].draw_outline(tiles[n], surface);
    slices[n].draw_marks(tiles[n], marks_of_slice(n, options, lower, upper),
                         {std::numeric_limits<double>::infinity(), false});
    if (n == 0) slices[n].draw_sides(tiles[n]);
    slices[n].draw_place(tiles[n]);
    picture.paste(tiles[n], n % options.columns * width, n / options.columns * height);
  }
  return picture;
}

std::optional<std::array<double, 2>> ct_window(const std::string& name) {
  // Level and width [HU] as on the consoles: 40/400, 400/1800, -600/1500, 40/80.
  static const std::map<std::string, std::array<double, 2>> windows = {{"soft-tissue", {-160, 240}},
                                                                       {"bone", {-500, 1300}},
                                                                       {"lung", {-1350, 150}},
                                                                       {"brain", {0, 80}}};
  const auto at = windows.find(name);
  if (at == windows.end()) return std::nullopt;
  return at->second;
}

const std::vector<std::string>& ct_windows() {
  static const std::vector<std::string> names = {"soft-tissue", "bone", "lung", "brain"};
  return names;
}

}  // namespace surf::io
