#include "libcurve/image/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/affine.h"
#include "libsurf/base/error.h"
#include "libsurf/base/memory.h"
#include "libsurf/base/values.h"

namespace surf::curve {
namespace {

void check_values(const std::vector<float>& values, int n_columns, const std::string& path) {
  const auto bad = std::find_if_not(values.begin(), values.end(), is_usable_value);
  if (bad == values.end()) return;
  const auto at = bad - values.begin();
  throw InputError(fmt::format("{}: pixel ({}, {}) is {}", path, at % n_columns, at / n_columns,
                               fault_of_value(*bad)));
}

}  // namespace

void check_image_size(const std::array<long long, 2>& size, const std::string& path) {
  if (size[0] < 2 || size[1] < 2)
    throw InputError(fmt::format("{}: {} x {} pixels; an image needs at least 2 along both axes",
                                 path, size[0], size[1]));
  if (!fits_in_memory(sizeof(float) * double(size[0]) * double(size[1])))
    throw InputError(fmt::format("{}: {} x {} pixels are more than can be held: {}", path, size[0],
                                 size[1], usable_memory_text()));
}

Image::Image(const std::array<int, 2>& size, const Eigen::Affine2d& pixel_to_plane,
             std::vector<float> values, ImageSource source,
             const std::optional<Eigen::Affine3d>& plane_to_ras, double thickness_mm) {
  if (source.path.empty()) source.path = "image";
  check_image_size({size[0], size[1]}, source.path);
  if (values.size() != std::size_t(size[0]) * size[1])
    throw InputError(fmt::format("{}: {} values for {} x {} pixels", source.path, values.size(),
                                 size[0], size[1]));
  check_values(values, size[0], source.path);
  const Eigen::Affine2d affine = checked_affine<2>(pixel_to_plane.matrix(), source.path, "pixel");
  const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
  const std::array<float, 2> range = {*lowest, *highest};
  data_ =
      std::make_shared<const Data>(Data{size, affine, affine.inverse(), plane_to_ras, thickness_mm,
                                        std::move(values), range, std::move(source)});
}

double Image::pixel_size() const {
  return std::sqrt(std::abs(pixel_to_plane().linear().determinant()));
}

bool Image::contains(const Eigen::Vector2d& point_mm) const {
  const Eigen::Array2d pixel = plane_to_pixel() * point_mm;
  return (pixel >= -0.5).all() && pixel[0] <= size()[0] - 0.5 && pixel[1] <= size()[1] - 0.5;
}

Eigen::Affine2d pixel_to_plane(const Eigen::Vector2d& spacing_mm) {
  return Eigen::Affine2d(Eigen::Scaling(spacing_mm));
}

}  // namespace surf::curve
