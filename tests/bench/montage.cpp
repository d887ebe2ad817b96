#include "tests/bench/montage.h"

#include <algorithm>
#include <cmath>

#include "libsurf/io/draw.h"
#include "libsurf/io/picture.h"

namespace surf::bench {
namespace {

constexpr int kGap = 4;
constexpr io::Color kStart = {96, 160, 255}, kPaper = {255, 255, 255};
constexpr double kLineWidth = 1.5;

void draw(const Segments& curves, const curve::Image& image, double scale, io::Color color,
          io::Picture& picture) {
  io::Lines lines(picture.width(), picture.height(), kLineWidth);
  const auto at = [&](int node) -> Vector<2> {
    const Vector<2> pixel = image.plane_to_pixel() * curves.points.row(node).transpose();
    return ((pixel.array() + 0.5) * scale - 0.5).matrix();
  };
  for (const auto element : curves.elements.rowwise()) lines.add(at(element[0]), at(element[1]));
  lines.draw(picture, color);
}

io::Picture drawn(const Panel& panel, int width) {
  const curve::Image& image = panel.image;
  const double scale = double(width) / image.size()[0];
  io::Picture picture(width, int(std::lround(scale * image.size()[1])));
  const auto [low, high] = panel.window;
  const auto pixel = [&](int at, int n) { return std::min(int((at + 0.5) / scale), n - 1); };
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < width; ++x) {
      const double value = image.value(pixel(x, image.size()[0]), pixel(y, image.size()[1]));
      const int level = int(255 * std::clamp((value - low) / (high - low), 0.0, 1.0));
      const auto grey = static_cast<std::uint8_t>(level - level % panel.grey_step);
      picture.at(x, y) = {grey, grey, grey};
    }
  draw(panel.start, image, scale, kStart, picture);
  draw(panel.curves, image, scale, io::kOutline, picture);
  return picture;
}

}  // namespace

void write_montage(const std::string& path, const std::vector<std::vector<Panel>>& rows,
                   int width) {
  std::vector<std::vector<io::Picture>> pictures;
  int total_width = 0, total_height = -kGap;
  for (const auto& row : rows) {
    pictures.emplace_back();
    int height = 0;
    for (const Panel& panel : row) {
      pictures.back().push_back(drawn(panel, width));
      height = std::max(height, pictures.back().back().height());
    }
    total_width = std::max(total_width, int(row.size()) * (width + kGap) - kGap);
    total_height += height + kGap;
  }
  io::Picture all(total_width, total_height, kPaper);
  int y = 0;
  for (const auto& row : pictures) {
    int height = 0;
    for (std::size_t k = 0; k < row.size(); ++k) {
      all.paste(row[k], int(k) * (width + kGap), y);
      height = std::max(height, row[k].height());
    }
    y += height + kGap;
  }
  io::write_png(path, all);
}

}  // namespace surf::bench
