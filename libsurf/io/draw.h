// What pictures of slices and images are drawn with.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "libsurf/io/picture.h"

namespace surf::io {

constexpr Color kOutline = {255, 96, 32};

/// Antialiased lines of one color. Their weights are gathered first and the color comes last, so
/// that lines that meet do not darken each other's ends.
class Lines {
 public:
  Lines(int width, int height, double line_width = 2)
      : width_(width),
        height_(height),
        half_width_(line_width / 2),
        weights_(std::size_t(width) * height, 0.0f) {}

  /// A line in picture coordinates; pixel (x, y) has its centre at (x, y).
  void add(const Eigen::Vector2d& a, const Eigen::Vector2d& b);
  /// @param picture  of the lines' size
  void draw(Picture& picture, Color color) const;

 private:
  int width_, height_;
  double half_width_;
  std::vector<float> weights_;
};

/// Text in letters of five by seven dots, `scale` pixels each, from its top left corner; of
/// capitals only A, I, L, P, R and S, digits and the point. Others leave a space.
void draw_text(Picture& picture, int x, int y, const std::string& text, Color color, int scale);
int text_width(const std::string& text, int scale);
int text_height(int scale);

/// The 0.5 and 99.5 percentiles: what is shown as black and white. NaN is passed over.
std::array<double, 2> automatic_window(std::vector<double> values);

}  // namespace surf::io
