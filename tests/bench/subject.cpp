#include "tests/bench/subject.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "libcurve/image/read_image.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/rasterize.h"
#include "libsurf/base/error.h"
#include "libsurf/base/random.h"
#include "libsurf/segment/contrast.h"

namespace surf::bench {
namespace {

using curve::Image;

/// The sides of pixels between object and background, the object on their left as rows run down.
Segments staircase(const std::vector<std::uint8_t>& object, const std::array<int, 2>& size) {
  const auto is_object = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < size[0] && j < size[1] &&
           object[std::size_t(j) * size[0] + i] != 0;
  };
  std::vector<Vector<2>> ends;
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      if (!is_object(i, j)) continue;
      const Vector<2> centre(i, j);
      for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        if (is_object(i + x, j + y)) continue;
        const Vector<2> normal(0.5 * x, 0.5 * y), along(-normal[1], normal[0]);
        ends.push_back(centre + normal - along);
        ends.push_back(centre + normal + along);
      }
    }
  const auto n = static_cast<Eigen::Index>(ends.size());
  Segments out{Points<2>(n, 2), Elements<2>(n / 2, 2)};
  for (Eigen::Index k = 0; k < n; ++k) {
    out.points.row(k) = ends[k];
    out.elements(k / 2, k % 2) = static_cast<int>(k);
  }
  return out;
}

double dice(const Segments& curves, const Subject& subject) {
  const auto mask = curve::rasterize(curves, subject.clean.size(), subject.clean.pixel_to_plane());
  double both = 0, sum = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    both += mask[i] && subject.object[i];
    sum += (mask[i] != 0) + (subject.object[i] != 0);
  }
  return 2 * both / sum;
}

}  // namespace

Subject phantom_subject(const std::string& name, const curve::PhantomOptions& phantom,
                        const Segments& start) {
  curve::PhantomOptions no_noise = phantom;
  no_noise.noise = 0;
  Subject out{.name = name,
              .clean = make_phantom(no_noise),
              .image = make_phantom(phantom),
              .contour = phantom_contour(phantom),
              .object = {},
              .start = start};
  out.object = curve::rasterize(out.contour, out.clean.size(), out.clean.pixel_to_plane());
  return out;
}

Subject image_subject(const std::string& name, const Image& image, const Image& mask) {
  if (image.size() != mask.size())
    throw InputError(
        fmt::format("{}: the mask has {} x {} pixels, the image {} x {}; give a mask of that image",
                    name, mask.size()[0], mask.size()[1], image.size()[0], image.size()[1]));
  Subject out{.name = name,
              .clean = image,
              .image = image,
              .contrast = segment::two_class_contrast(image.values()),
              .contour = {},
              .object = {},
              .start = {}};
  for (const float value : mask.values()) out.object.push_back(value != 0);
  out.contour = staircase(out.object, image.size());
  if (out.contour.elements.rows() == 0)
    throw InputError(fmt::format("{}: no pixel of the mask is other than 0", name));
  return out;
}

Subject image_subject(const std::string& name, const std::string& image, const std::string& mask) {
  const curve::ReadImageOptions in_pixels{.spacing_mm = Eigen::Vector2d(1, 1)};
  return image_subject(name, curve::read_image(image, in_pixels),
                       curve::read_image(mask, in_pixels));
}

Image with_noise(const Subject& subject, double sigma) {
  std::vector<float> values = subject.clean.values();
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = float(values[at] + sigma * subject.contrast * normal_random(0, at));
  return {subject.clean.size(), subject.clean.pixel_to_plane(), std::move(values)};
}

double psnr(const Image& image, const Subject& subject) {
  double sum = 0;
  for (std::size_t i = 0; i < image.n_pixels(); ++i)
    sum += std::pow(double(image.values()[i]) - subject.clean.values()[i], 2);
  return -10 * std::log10(sum / double(image.n_pixels()) / std::pow(subject.contrast, 2));
}

Agreement agreement(const Segments& curves, const Subject& subject) {
  return {curve::regions(curve::curve_hierarchy(curves)).size(), dice(curves, subject),
          curve::curve_distances(curves, subject.contour).mean_mm};
}

std::string found(const Segments& curves, const Subject& subject) {
  if (curves.elements.rows() == 0) return "0 | | ";
  const Agreement of = agreement(curves, subject);
  return fmt::format("{} | {:.4f} | {:.3f}", of.n_regions, of.dice, of.mean_px);
}

}  // namespace surf::bench
