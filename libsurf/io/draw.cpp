#include "libsurf/io/draw.h"

#include <algorithm>
#include <cmath>

namespace surf::io {

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

std::array<double, 2> automatic_window(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) return {0, 1};
  std::sort(values.begin(), values.end());
  const auto percentile = [&](double share) {
    return values[static_cast<std::size_t>(share * double(values.size() - 1))];
  };
  const double low = percentile(0.005), high = percentile(0.995);
  return {low, high > low ? high : low + 1};
}

}  // namespace surf::io
