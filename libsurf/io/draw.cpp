#include "libsurf/io/draw.h"

#include <algorithm>
#include <cmath>

namespace surf::io {
namespace {

constexpr int kColumns = 5, kRows = 7;

/// A row's dots from the left.
struct Glyph {
  char letter;
  std::array<std::uint8_t, kRows> rows;
};
constexpr std::array<Glyph, 20> kGlyphs = {{{'R', {0x1E, 0x11, 0x11, 0x1E, 0x14, 0x12, 0x11}},
                                            {'L', {0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1F}},
                                            {'A', {0x0E, 0x11, 0x11, 0x1F, 0x11, 0x11, 0x11}},
                                            {'P', {0x1E, 0x11, 0x11, 0x1E, 0x10, 0x10, 0x10}},
                                            {'S', {0x0F, 0x10, 0x10, 0x0E, 0x01, 0x01, 0x1E}},
                                            {'I', {0x0E, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0E}},
                                            {'0', {0x0E, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0E}},
                                            {'1', {0x04, 0x0C, 0x04, 0x04, 0x04, 0x04, 0x0E}},
                                            {'2', {0x0E, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1F}},
                                            {'3', {0x1F, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0E}},
                                            {'4', {0x02, 0x06, 0x0A, 0x12, 0x1F, 0x02, 0x02}},
                                            {'5', {0x1F, 0x10, 0x1E, 0x01, 0x01, 0x11, 0x0E}},
                                            {'6', {0x06, 0x08, 0x10, 0x1E, 0x11, 0x11, 0x0E}},
                                            {'7', {0x1F, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
                                            {'8', {0x0E, 0x11, 0x11, 0x0E, 0x11, 0x11, 0x0E}},
                                            {'9', {0x0E, 0x11, 0x11, 0x0F, 0x01, 0x02, 0x0C}},
                                            {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0C, 0x0C}},
                                            {'-', {0x00, 0x00, 0x00, 0x1F, 0x00, 0x00, 0x00}},
                                            {'+', {0x00, 0x04, 0x04, 0x1F, 0x04, 0x04, 0x00}},
                                            {'e', {0x00, 0x00, 0x0E, 0x11, 0x1F, 0x10, 0x0E}}}};

void draw_glyph(Picture& picture, int x, int y, const Glyph& glyph, Color color, int scale) {
  for (int row = 0; row < kRows * scale; ++row)
    for (int column = 0; column < kColumns * scale; ++column)
      if ((glyph.rows[row / scale] >> (kColumns - 1 - column / scale) & 1) != 0)
        picture.blend(x + column, y + row, color, 1);
}

}  // namespace

void Lines::add(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double reach = half_width_ + 1;
  const Eigen::Vector2d lower = a.cwiseMin(b).array() - reach;
  const Eigen::Vector2d upper = a.cwiseMax(b).array() + reach;
  const Eigen::Vector2d direction = b - a;
  const double square = std::max(direction.squaredNorm(), 1e-12);
  for (int y = std::max(0, int(lower[1])); y <= std::min(height_ - 1.0, upper[1]); ++y)
    for (int x = std::max(0, int(lower[0])); x <= std::min(width_ - 1.0, upper[0]); ++x) {
      const Eigen::Vector2d pixel(x, y);
      const double t = std::clamp(direction.dot(pixel - a) / square, 0.0, 1.0);
      const double distance = (pixel - a - t * direction).norm();
      const auto weight = static_cast<float>(std::clamp(half_width_ + 0.5 - distance, 0.0, 1.0));
      float& kept = weights_[std::size_t(y) * width_ + x];
      kept = std::max(kept, weight);
    }
}

void Lines::draw(Picture& picture, Color color) const {
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      picture.blend(x, y, color, weights_[std::size_t(y) * width_ + x]);
}

void draw_text(Picture& picture, int x, int y, const std::string& text, Color color, int scale) {
  for (const char letter : text) {
    for (const Glyph& glyph : kGlyphs)
      if (glyph.letter == letter) draw_glyph(picture, x, y, glyph, color, scale);
    x += (kColumns + 1) * scale;
  }
}

int text_width(const std::string& text, int scale) {
  return text.empty() ? 0 : ((kColumns + 1) * int(text.size()) - 1) * scale;
}

int text_height(int scale) { return kRows * scale; }

std::array<double, 2> automatic_window(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return {0, 1};
  const auto percentile = [&](double share) {
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const double low = percentile(0.005), high = percentile(0.995);
  return {low, high > low ? high : low + 1};
}

}  // namespace surf::io
