#include "libcurve/segment/seed_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

Segments kept_in_objects(const Image& image, const Segments& circles, bool are_dark) {
  double mean = 0;
  for (const float value : image.values()) mean += value / double(image.n_pixels());
  const CurveHierarchy hierarchy = curve_hierarchy(circles);
  std::vector<char> keep;
  for (const auto& component : hierarchy.components) {
    const Eigen::Vector2d pixel = image.plane_to_pixel() * component.centre;
    const int i = std::clamp(int(std::lround(pixel[0])), 0, image.size()[0] - 1),
              j = std::clamp(int(std::lround(pixel[1])), 0, image.size()[1] - 1);
    keep.push_back((image.value(i, j) > mean) != are_dark);
  }
  return kept(circles, hierarchy, keep);
}

Eigen::AlignedBox2d extent_of(const Image& image) {
  Eigen::AlignedBox2d box;
  for (const double i : {0.0, image.size()[0] - 1.0})
    for (const double j : {0.0, image.size()[1] - 1.0})
      box.extend(image.pixel_to_plane() * Eigen::Vector2d(i, j));
  return box;
}

}  // namespace

std::string SeedGridOptions::error() const {
  if (!(spacing_mm > 0))
    return fmt::format("SeedGridOptions::spacing_mm = {} violates > 0", spacing_mm);
  if (radius_mm && !(*radius_mm > 0))
    return fmt::format("SeedGridOptions::radius_mm = {} violates > 0", *radius_mm);
  if (radius_mm && *radius_mm >= 0.5 * spacing_mm)
    return fmt::format(
        "SeedGridOptions::radius_mm = {}: circles at a distance of {} mm would touch; make them "
        "smaller",
        *radius_mm, spacing_mm);
  if (!(edge_length_mm > 0))
    return fmt::format("SeedGridOptions::edge_length_mm = {} violates > 0", edge_length_mm);
  return "";
}

Segments seed_grid(const Image& image, const SeedGridOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  const double radius = options.radius_mm.value_or(0.3 * options.spacing_mm);
  const Eigen::AlignedBox2d box = extent_of(image);
  constexpr double kMostCircles = 1e6;
  const double n_circles = (box.sizes().array() / options.spacing_mm + 0.5).floor().prod();
  if (!(n_circles <= kMostCircles))
    throw UsageError(fmt::format(
        "SeedGridOptions::spacing_mm = {} means {:.3g} circles, of which there may be {:g}; make "
        "it larger",
        options.spacing_mm, n_circles, kMostCircles));
  const Segments circles = grid_of_circles(box.min(), box.max(), options.spacing_mm, radius,
                                           std::min(options.edge_length_mm, radius / 2));
  Segments out =
      circles.elements.rows() == 0 ? circles : kept_in_objects(image, circles, options.are_dark);
  if (circles.elements.rows() == 0)
    throw UsageError(
        fmt::format("SeedGridOptions::spacing_mm = {} is more than the image", options.spacing_mm));
  if (out.elements.rows() == 0)
    throw UsageError(fmt::format(
        "SeedGridOptions::spacing_mm: at no circle's centre the image is {} than its mean; {}",
        options.are_dark ? "darker" : "brighter",
        options.are_dark ? "objects are looked for that are darker"
                         : "for objects that are darker there is SeedGridOptions::are_dark"));
  return out;
}

}  // namespace surf::curve
