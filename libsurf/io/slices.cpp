#include "libsurf/io/slices.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/io/draw.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/volume/interpolate.h"
#include "libsurf/volume/orientation.h"

namespace surf::io {
namespace {

constexpr Color kBackground = {0, 0, 0};
constexpr Color kLetters = {120, 200, 255};
constexpr int kGap = 6;  // pixels between the slices

/// A slice: the world's axes across and up. World coordinates fall to the right, which puts R
/// and A on the left, and rise upwards.
struct View {
  int across, up, normal;     ///< axes, 0 to 2
  std::array<char, 4> sides;  ///< letters left, right, top, bottom
};
constexpr std::array<View, 3> kViews = {{{0, 1, 2, {'R', 'L', 'A', 'P'}},
                                         {0, 2, 1, {'R', 'L', 'S', 'I'}},
                                         {1, 2, 0, {'A', 'P', 'S', 'I'}}}};

/// Five columns by seven rows; a row's bits from the left.
struct Glyph {
  char letter;
  std::array<std::uint8_t, 7> rows;
};
constexpr std::array<Glyph, 6> kGlyphs = {{{'R', {0x1E, 0x11, 0x11, 0x1E, 0x14, 0x12, 0x11}},
                                           {'L', {0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1F}},
                                           {'A', {0x0E, 0x11, 0x11, 0x1F, 0x11, 0x11, 0x11}},
                                           {'P', {0x1E, 0x11, 0x11, 0x1E, 0x10, 0x10, 0x10}},
                                           {'S', {0x0F, 0x10, 0x10, 0x0E, 0x01, 0x01, 0x1E}},
                                           {'I', {0x0E, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0E}}}};

using Box = Eigen::AlignedBox3d;

Box shown_box(const Triangles& surface, const volume::Volume& volume, const Vector<3>& center) {
  const auto [lower, upper] = volume::bounds_ras_mm(volume.index_to_world(), volume.size());
  const Box whole(lower, upper);
  if (!whole.contains(center))
    throw UsageError(fmt::format(
        "slices through {:.1f},{:.1f},{:.1f} mm (RAS) miss the volume; are the surface and the "
        "volume of the same scan and space?",
        center[0], center[1], center[2]));
  Box box(center, center);
  for (const auto point : surface.points.rowwise()) box.extend(Vector<3>(point.transpose()));
  const Vector<3> margin = Vector<3>::Constant(0.5 * box.sizes().maxCoeff());
  return Box(box.min() - margin, box.max() + margin).intersection(whole);
}

/// Pixels of one slice and where they lie in the world.
class Slice {
 public:
  Slice(const View& view, const Box& box, const Vector<3>& center, double mm_per_pixel)
      : view_(view),
        box_(box),
        center_(center),
        mm_per_pixel_(mm_per_pixel),
        width_(pixels(view.across)),
        height_(pixels(view.up)) {}

  int width() const { return width_; }
  int height() const { return height_; }

  std::vector<double> sample(const volume::Volume& volume) const {
    std::vector<double> values;
    values.reserve(std::size_t(width_) * height_);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        values.push_back(volume::interpolate(volume, volume.world_to_index() * world(x, y)));
    return values;
  }

  Picture draw(const std::vector<double>& values, const std::array<double, 2>& window,
               const Triangles& surface) const {
    Picture picture(width_, height_, kBackground);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const double value = values[std::size_t(y) * width_ + x];
        if (std::isnan(value)) continue;
        const double grey = std::clamp((value - window[0]) / (window[1] - window[0]), 0.0, 1.0);
        picture.at(x, y).fill(static_cast<std::uint8_t>(std::lround(255 * grey)));
      }
    draw_outline(picture, surface);
    draw_letters(picture);
    return picture;
  }

 private:
  int pixels(int axis) const {
    return std::max(1, static_cast<int>(std::lround(box_.sizes()[axis] / mm_per_pixel_)));
  }

  Vector<3> world(int x, int y) const {
    Vector<3> point = center_;
    point[view_.across] = box_.max()[view_.across] - (x + 0.5) * mm_per_pixel_;
    point[view_.up] = box_.max()[view_.up] - (y + 0.5) * mm_per_pixel_;
    return point;
  }

  /// Picture coordinates of a world point; pixel (x, y) has its centre at (x, y).
  Eigen::Vector2d project(const Vector<3>& point) const {
    const double across = box_.max()[view_.across] - point[view_.across];
    return Eigen::Vector2d(across, box_.max()[view_.up] - point[view_.up]) / mm_per_pixel_ -
           Eigen::Vector2d(0.5, 0.5);
  }

  void draw_outline(Picture& picture, const Triangles& surface) const {
    Lines lines(width_, height_);
    for (const auto element : surface.elements.rowwise()) {
      std::array<Eigen::Vector2d, 2> ends;
      int n_ends = 0;
      for (int i = 0; i < 3 && n_ends < 2; ++i) {
        const Vector<3> a = surface.points.row(element[i]);
        const Vector<3> b = surface.points.row(element[(i + 1) % 3]);
        const double above_a = a[view_.normal] - center_[view_.normal];
        const double above_b = b[view_.normal] - center_[view_.normal];
        if ((above_a < 0) == (above_b < 0)) continue;
        ends[n_ends++] = project(a + above_a / (above_a - above_b) * (b - a));
      }
      if (n_ends == 2) lines.add(ends[0], ends[1]);
    }
    lines.draw(picture, kOutline);
  }

  void draw_letters(Picture& picture) const {
    constexpr int kScale = 2, kMargin = 4;
    constexpr int kLetterWidth = 5 * kScale, kLetterHeight = 7 * kScale;
    const int middle_x = (width_ - kLetterWidth) / 2, middle_y = (height_ - kLetterHeight) / 2;
    const std::array<std::array<int, 2>, 4> corners = {
        {{kMargin, middle_y},
         {width_ - kMargin - kLetterWidth, middle_y},
         {middle_x, kMargin},
         {middle_x, height_ - kMargin - kLetterHeight}}};
    for (std::size_t side = 0; side < corners.size(); ++side)
      for (const Glyph& glyph : kGlyphs)
        if (glyph.letter == view_.sides[side])
          for (int y = 0; y < kLetterHeight; ++y)
            for (int x = 0; x < kLetterWidth; ++x)
              if ((glyph.rows[y / kScale] >> (4 - x / kScale) & 1) != 0)
                picture.blend(corners[side][0] + x, corners[side][1] + y, kLetters, 1);
  }

  const View& view_;
  const Box& box_;
  Vector<3> center_;
  double mm_per_pixel_;
  int width_, height_;
};

void check(const SliceOptions& options) {
  constexpr int kMinWidth = 100, kMaxWidth = 20000;
  if (options.width < kMinWidth || options.width > kMaxWidth)
    throw UsageError(fmt::format("width of the picture: expected {} to {} pixels; got {}",
                                 kMinWidth, kMaxWidth, options.width));
  if (options.window && !((*options.window)[0] < (*options.window)[1]))
    throw UsageError(fmt::format("window {},{}: the first value must be less than the second",
                                 (*options.window)[0], (*options.window)[1]));
}

}  // namespace

Picture draw_slices(const Triangles& surface, const volume::Volume& volume,
                    const SliceOptions& options) {
  check(options);
  const Vector<3> center = options.center_ras_mm.value_or(mesh::centroid(surface));
  const Box box = shown_box(surface, volume, center);
  double total_mm = 0;
  for (const View& view : kViews) total_mm += box.sizes()[view.across];
  const double mm_per_pixel = total_mm / (options.width - 2 * kGap);

  std::vector<Slice> slices;
  slices.reserve(kViews.size());
  for (const View& view : kViews) slices.emplace_back(view, box, center, mm_per_pixel);
  std::vector<std::vector<double>> values;
  std::vector<double> all;
  int width = 2 * kGap, height = 0;
  for (const Slice& slice : slices) {
    values.push_back(slice.sample(volume));
    all.insert(all.end(), values.back().begin(), values.back().end());
    width += slice.width();
    height = std::max(height, slice.height());
  }
  const auto window = options.window.value_or(automatic_window(std::move(all)));
  Picture picture(width, height, kBackground);
  int x = 0;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    picture.paste(slices[i].draw(values[i], window, surface), x, (height - slices[i].height()) / 2);
    x += slices[i].width() + kGap;
  }
  return picture;
}

}  // namespace surf::io
