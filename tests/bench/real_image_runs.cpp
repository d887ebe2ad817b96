#include "tests/bench/real_image_runs.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "libcurve/image/image_fields.h"
#include "libcurve/mesh/from_level.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/rasterize.h"
#include "libsurf/base/random.h"

namespace surf::bench {
namespace {

using curve::Image;
using std::numbers::pi;

constexpr double kEdge = 1;           // of curves, in pixels
constexpr double kPathSpacing = 0.5;  // in pixels
/// Where H = 1 the first H1 step of a seed of radius r is r^2 / (kBetaFloor gamma_0): with 100, and
/// gamma_0 and r as here, a tenth of a pixel.
constexpr double kBetaFloor = 10;

/// Pixels to a plane in which the shortest of `size` sides is [-1, 1], 0 in the middle.
Eigen::Affine2d pixel_to_unit(const std::array<int, 2>& size) {
  const double pixel = 2.0 / std::min(size[0], size[1]);
  Eigen::Affine2d out = Eigen::Affine2d::Identity();
  out.linear() *= pixel;
  out.translation() << -pixel * (size[0] - 1) / 2, -pixel * (size[1] - 1) / 2;
  return out;
}

Segments transformed(Segments curves, const Eigen::Affine2d& map) {
  for (Eigen::Index i = 0; i < curves.points.rows(); ++i)
    curves.points.row(i) = (map * curves.points.row(i).transpose()).transpose();
  return curves;
}

/// What is within `radius` of a segment.
struct Capsule {
  Vector<2> a, b;
  double radius;
};

const std::vector<Capsule>& vertebra() {
  static const std::vector<Capsule> kParts = {
      {{-0.08, -0.4}, {0.08, -0.4}, 0.36},                                     // body
      {{-0.3, -0.2}, {-0.32, 0.2}, 0.1},   {{0.3, -0.2}, {0.32, 0.2}, 0.1},    // pedicles
      {{-0.32, 0.2}, {0, 0.42}, 0.1},      {{0.32, 0.2}, {0, 0.42}, 0.1},      // laminae
      {{-0.32, 0.15}, {-0.78, 0.3}, 0.08}, {{0.32, 0.15}, {0.78, 0.3}, 0.08},  // transverse
      {{0, 0.42}, {0, 0.8}, 0.09}};                                            // spinous
  return kParts;
}

/// Signed distance to the outline in units, negative inside; there a bound where parts overlap.
double vertebra_distance(const Vector<2>& u) {
  double least = 1e300;
  for (const auto& [a, b, radius] : vertebra()) {
    const Vector<2> ab = b - a;
    const double t = std::clamp((u - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (u - a - t * ab).norm() - radius);
  }
  return least;
}

}  // namespace

Prepared prepare(const Image& image, const RealImageParameters& parameters, bool is_selective) {
  const Eigen::Affine2d map = pixel_to_unit(image.size());
  const auto [low, high] = parameters.window;
  std::vector<float> values = image.values();
  for (float& value : values) value = float(std::clamp((value - low) / (high - low), 0.0, 1.0));
  Prepared out{Image(image.size(), map, std::move(values)), {}, {}};
  const double pixel = out.image.pixel_size();
  curve::FieldOptions options;
  options.filter = volume::DerivativeFilter::kScharr;
  options.smoothing.sigma_mm = parameters.sigma_px * pixel;
  if (is_selective) {
    options.smoothing.selective_sigma_mm = parameters.selective_sigma_px * pixel;
    options.smoothing.selective_threshold = parameters.selective_threshold;
  }
  out.intensity = curve::intensity_field(out.image, options);
  out.H = curve::edge_indicator(out.image, options, parameters.lambda);
  return out;
}

Image sampled(const Field<2>& field, const Prepared& prepared) {
  const auto [width, height] = prepared.image.size();
  Points<2> centres(Eigen::Index(width) * height, 2);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i)
      centres.row(Eigen::Index(j) * width + i) =
          (prepared.image.pixel_to_plane() * Vector<2>(i, j)).transpose();
  Samples<2> samples;
  field.sample(centres, Derivatives::kNone, samples);
  return {prepared.image.size(), Eigen::Affine2d::Identity(),
          std::vector<float>(samples.value.begin(), samples.value.end())};
}

Descended descend(const Prepared& prepared, const RealImageParameters& parameters,
                  const Segments& start, flow::ScalarProduct product, const EachStep& each_step) {
  const Image& unit = prepared.image;
  const double pixel = unit.pixel_size();
  Descent descent;
  descent.H = prepared.H;
  descent.gamma_0 = parameters.gamma_0;
  descent.gamma = parameters.gamma;
  descent.product = product;
  descent.beta_floor = kBetaFloor;
  descent.tolerance =
      product == flow::ScalarProduct::kL2 ? parameters.tolerance_L2 : parameters.tolerance_H1;
  descent.ray_spacing_mm = pixel / 2;
  descent.curves.edge_length_mm = kEdge * pixel;
  descent.curves.max_displacement_mm = 2 * std::max(parameters.sigma_px, 1.0) * pixel;
  descent.curves.edge_indicator = prepared.H;  // no edge is jumped over
  descent.curves.path_spacing_mm = kPathSpacing * pixel;
  descent.curves.box = ImageBox<2>{unit.size(), unit.pixel_to_plane(), unit.plane_to_pixel()};
  EachStep in_pixels;
  if (each_step)
    in_pixels = [&](const flow::StepRecord& record, const Segments& curves) {
      each_step(record, transformed(curves, unit.plane_to_pixel()));
    };
  Descended out = descend(transformed(start, unit.pixel_to_plane()), descent, in_pixels);
  out.curves = transformed(out.curves, unit.plane_to_pixel());
  return out;
}

Subject vertebra_phantom(const VertebraOptions& options) {
  const std::array<int, 2> size = {options.n_pixels, options.n_pixels};
  const Eigen::Affine2d map = pixel_to_unit(size);
  const double pixel = map.linear()(0, 0);
  std::vector<float> depth, values;
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      const double d = -vertebra_distance(map * Vector<2>(i, j)) / pixel;
      const std::uint64_t at = depth.size();
      depth.push_back(float(d));
      values.push_back(float(0.25 + 0.25 * (1 + std::erf(d)) +
                             options.texture * std::cos(pi / 4 * i) * std::cos(pi / 4 * j) +
                             options.noise * normal_random(0, at)));
    }
  const Eigen::Affine2d in_pixels = Eigen::Affine2d::Identity();
  const Image image(size, in_pixels, std::move(values));
  Subject out{.name = "phantom",
              .clean = image,
              .image = image,
              .contrast = 0.5,
              .contour = curve::curve_of_level(depth, size, in_pixels, 0),
              .object = {},
              .start = {}};
  out.object = curve::rasterize(out.contour, size, in_pixels);
  return out;
}

RealImageParameters vertebra_parameters() {
  RealImageParameters out;
  out.selective_sigma_px = 4;
  out.selective_threshold = 50.0 / 255;
  out.sigma_px = 1.5;
  out.gamma_0 = 0.03;
  out.gamma = -1;
  out.lambda = 0.5;
  out.tolerance_L2 = out.tolerance_H1 = 1e-4;
  return out;
}

Segments vertebra_seeds(int n_pixels, int n_seeds) {
  const Eigen::Affine2d map = pixel_to_unit({n_pixels, n_pixels}).inverse();
  const double unit = map.linear()(0, 0);
  std::vector<Segments> out = {curve::circle(map * Vector<2>(0, -0.4), 0.1 * unit, kEdge)};
  for (int k = 1; k < n_seeds; ++k)
    out.push_back(curve::circle(map * Vector<2>(k == 1 ? -0.32 : 0.32, 0.2), 0.05 * unit, kEdge));
  return curve::joined(out);
}

}  // namespace surf::bench
