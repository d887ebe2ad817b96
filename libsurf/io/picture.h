// Pictures in memory, and PNG and JPEG files of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace surf::io {

using Color = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// Pixels row by row from the top left.
class Picture {
 public:
  Picture(int width, int height, Color color = {0, 0, 0})
      : width_(width), height_(height), pixels_(std::size_t(width) * height, color) {}

  int width() const { return width_; }
  int height() const { return height_; }
  Color& at(int x, int y) { return pixels_[std::size_t(y) * width_ + x]; }
  const Color& at(int x, int y) const { return pixels_[std::size_t(y) * width_ + x]; }
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  /// Mixes a color in: weight 0 leaves the pixel as it is, 1 replaces it. Outside: nothing.
  void blend(int x, int y, Color color, double weight);
  /// Copies another picture in with its top left corner at (x, y); it must fit.
  void paste(const Picture& other, int x, int y);

 private:
  int width_, height_;
  std::vector<Color> pixels_;
};

/// Writes the picture as PNG, whole or not at all; the same picture gives the same bytes.
/// @throws UsageError   the name does not end in .png
/// @throws OutputError  the file cannot be written
void write_png(const std::string& path, const Picture& picture);

/// The bytes of a JPEG file of it, for pages.
/// @param quality  1 to 100
/// @throws OutputError  libjpeg's reason
std::string jpeg_bytes(const Picture& picture, int quality);

}  // namespace surf::io
