#include "libsurf/io/detail/slice_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/io/draw.h"
#include "libsurf/volume/interpolate.h"

namespace surf::io::detail {
namespace {

constexpr Color kLetters = {120, 200, 255};
constexpr Color kInside = {90, 255, 120}, kOutside = {255, 100, 220};
constexpr int kMargin = 4;  // pixels round letters

/// Letters of the negative and positive side of the world's axes.
constexpr std::array<std::array<char, 2>, 3> kDirections = {{{'L', 'R'}, {'P', 'A'}, {'I', 'S'}}};

/// Pixels of a letter's dot.
int letter_scale(int width) { return width < 160 ? 1 : 2; }

void draw_cross(Lines& lines, const Eigen::Vector2d& at) {
  constexpr double kArm = 7, kGap = 2;  // the place itself stays free
  for (const Eigen::Vector2d& way : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
                                     Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)})
    lines.add(at + kGap * way, at + kArm * way);
}

void draw_ring(Lines& lines, const Eigen::Vector2d& at) {
  constexpr int kSides = 16;
  constexpr double kRadius = 4;
  const auto corner = [&](int n) -> Eigen::Vector2d {
    const double angle = 2 * M_PI * n / kSides;
    return at + kRadius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  };
  for (int n = 0; n < kSides; ++n) lines.add(corner(n), corner(n + 1));
}

}  // namespace

const std::array<View, 3> kViews = {{{0, 1, 2, {'R', 'L', 'A', 'P'}},
                                     {0, 2, 1, {'R', 'L', 'S', 'I'}},
                                     {1, 2, 0, {'A', 'P', 'S', 'I'}}}};

SliceView::SliceView(const View& view, const Eigen::AlignedBox3d& box, const Vector<3>& center,
                     double mm_per_pixel)
    : view_(view),
      box_(box),
      center_(center),
      mm_per_pixel_(mm_per_pixel),
      width_(pixels(view.across)),
      height_(pixels(view.up)) {}

std::vector<double> SliceView::sample(const volume::Volume& volume) const {
  std::vector<Vector<3>> indices;
  indices.reserve(std::size_t(width_) * height_);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) indices.push_back(volume.world_to_index() * world(x, y));
  return volume::interpolate(volume, indices);
}

Picture SliceView::draw(const std::vector<double>& values,
                        const std::array<double, 2>& window) const {
  Picture picture(width_, height_, kBackground);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const double value = values[std::size_t(y) * width_ + x];
      if (std::isnan(value)) continue;
      const double grey = std::clamp((value - window[0]) / (window[1] - window[0]), 0.0, 1.0);
      picture.at(x, y).fill(static_cast<std::uint8_t>(std::lround(255 * grey)));
    }
  return picture;
}

void SliceView::draw_outline(Picture& picture, const Triangles& surface) const {
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

void SliceView::draw_marks(Picture& picture, const std::vector<Mark>& marks,
                           const MarkStyle& style) const {
  for (const bool is_inside : {false, true}) {
    Lines lines(width_, height_);
    for (const Mark& mark : marks) {
      if (mark.is_inside != is_inside) continue;
      const double away = std::abs(mark.point_ras_mm[view_.normal] - center_[view_.normal]);
      if (away <= style.cross_mm)
        draw_cross(lines, project(mark.point_ras_mm));
      else if (style.has_rings)
        draw_ring(lines, project(mark.point_ras_mm));
    }
    lines.draw(picture, is_inside ? kInside : kOutside);
  }
}

void SliceView::draw_sides(Picture& picture) const {
  const int scale = letter_scale(width_);
  const int width = text_width("R", scale), height = text_height(scale);
  const int middle_x = (width_ - width) / 2, middle_y = (height_ - height) / 2;
  const std::array<std::array<int, 2>, 4> corners = {{{kMargin, middle_y},
                                                      {width_ - kMargin - width, middle_y},
                                                      {middle_x, kMargin},
                                                      {middle_x, height_ - kMargin - height}}};
  for (std::size_t side = 0; side < corners.size(); ++side)
    draw_text(picture, corners[side][0], corners[side][1], std::string(1, view_.sides[side]),
              kLetters, scale);
}

void SliceView::draw_place(Picture& picture) const {
  const double place = center_[view_.normal];
  const std::string text =
      fmt::format("{}{:.1f}", kDirections[view_.normal][place > 0 ? 1 : 0], std::abs(place));
  draw_text(picture, kMargin, kMargin, text, kLetters, letter_scale(width_));
}

int SliceView::pixels(int axis) const {
  return std::max(1, static_cast<int>(std::lround(box_.sizes()[axis] / mm_per_pixel_)));
}

Vector<3> SliceView::world(int x, int y) const {
  Vector<3> point = center_;
  point[view_.across] = box_.max()[view_.across] - (x + 0.5) * mm_per_pixel_;
  point[view_.up] = box_.max()[view_.up] - (y + 0.5) * mm_per_pixel_;
  return point;
}

Eigen::Vector2d SliceView::project(const Vector<3>& point) const {
  const double across = box_.max()[view_.across] - point[view_.across];
  return Eigen::Vector2d(across, box_.max()[view_.up] - point[view_.up]) / mm_per_pixel_ -
         Eigen::Vector2d(0.5, 0.5);
}

}  // namespace surf::io::detail
