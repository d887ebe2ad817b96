// For each model of thesis 1.1 that is said to help, an image where it does: phantoms by formula,
// the same start, two models. The table and pictures of docs/energies.md.
//
//   model_study DIRECTORY
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/segment.h"
#include "libsurf/io/draw.h"
#include "libsurf/io/picture.h"

namespace {

using namespace surf;
using segment::EnergyTerm;

constexpr int kPixels = 192;  // [-1, 1]^2 in units, a unit is 1 mm
constexpr double kPixel = 2.0 / (kPixels - 1);

struct Model {
  std::string name;
  std::vector<EnergyTerm> terms;
};

struct Case {
  std::string name, file;
  std::function<double(const Vector<2>&)> depth;  ///< signed distance or the like, > 0 inside
  curve::Image image;
  Segments start;
  std::vector<Model> models;
};

Vector<2> unit_of(int i, int j) { return Vector<2>(i, j) * kPixel - Vector<2>::Ones(); }

curve::Image image_of(const std::function<double(const Vector<2>&)>& intensity) {
  std::vector<float> values;
  for (int j = 0; j < kPixels; ++j)
    for (int i = 0; i < kPixels; ++i)
      values.push_back(static_cast<float>(intensity(unit_of(i, j))));
  return curve::Image({kPixels, kPixels}, curve::pixel_to_plane({kPixel, kPixel}), values);
}

Segments circle(const Vector<2>& centre, double radius) {
  return curve::circle(centre + Vector<2>::Ones(), radius, 3 * kPixel);
}

double smooth_step(double depth, double width) { return (1 + std::erf(2 * depth / width)) / 2; }

/// A disc of radius 0.7 with a slot from the right, 0.4 wide, to x = -0.2.
double slotted_disc(const Vector<2>& x) {
  const double disc = 0.7 - x.norm();
  const double slot = std::max(std::abs(x[1]) - 0.2, -0.2 - x[0]);
  return std::min(disc, slot);
}

double blob(const Vector<2>& x) {
  const double angle = std::atan2(x[1], x[0]);
  return 0.5 * (1 + 0.15 * std::cos(3 * angle)) - x.norm();
}

/// Unit normal noise, smoothed by a Gaussian of 1.5 pixels and scaled back to deviation 1.
std::vector<double> texture() {
  std::mt19937 generator(7);
  std::vector<double> white(std::size_t(kPixels) * kPixels), out(white.size());
  for (double& value : white) {  // sum of twelve: the same on every platform
    for (int k = 0; k < 12; ++k) value += double(generator()) / 4294967296.0;
    value -= 6;
  }
  constexpr int kReach = 5;
  constexpr double kSigma = 1.5;
  const double scale = 2 * kSigma * std::sqrt(std::acos(-1.0));  // of the smoothed deviation
  for (int j = 0; j < kPixels; ++j)
    for (int i = 0; i < kPixels; ++i) {
      double sum = 0, weights = 0;
      for (int b = -kReach; b <= kReach; ++b)
        for (int a = -kReach; a <= kReach; ++a) {
          const int x = std::clamp(i + a, 0, kPixels - 1), y = std::clamp(j + b, 0, kPixels - 1);
          const double weight = std::exp(-(a * a + b * b) / (2 * kSigma * kSigma));
          sum += weight * white[std::size_t(y) * kPixels + x];
          weights += weight;
        }
      out[std::size_t(j) * kPixels + i] = sum / weights * scale;
    }
  return out;
}

curve::Image textured() {
  const std::vector<double> noise = texture();
  std::size_t at = 0;
  return image_of([&](const Vector<2>& x) {
    const double inside = smooth_step(blob(x), 0.04);
    return (0.3 * inside + 0.1 * (1 - inside)) * noise[at++];
  });
}

/// The circle of radius 0.72, drawn a third of the way into the slot.
Segments notched_circle() {
  std::vector<Vector<2>> corners;
  const double mouth = std::asin(0.17 / 0.72);
  for (int k = 0; k <= 200; ++k) {
    const double angle = mouth + (2 * std::acos(-1.0) - 2 * mouth) * k / 200;
    corners.push_back(0.72 * Vector<2>(std::cos(angle), std::sin(angle)));
  }
  const double x_mouth = corners.back()[0];
  for (int k = 1; k <= 20; ++k) corners.push_back({x_mouth + (0.4 - x_mouth) * k / 20, -0.17});
  for (int k = 1; k <= 20; ++k) corners.push_back({0.4, -0.17 + 0.34 * k / 20});
  for (int k = 1; k < 20; ++k) corners.push_back({0.4 + (x_mouth - 0.4) * k / 20, 0.17});
  Segments out;
  const int n = static_cast<int>(corners.size());
  out.points.resize(n, 2);
  out.elements.resize(n, 2);
  for (int i = 0; i < n; ++i) {
    out.points.row(i) = corners[i] + Vector<2>::Ones();
    out.elements.row(i) << i, (i + 1) % n;
  }
  return out;
}

EnergyTerm minimal_surface(double lambda) {
  return {"minimal-surface", 1, {{"gamma0", 1}, {"gamma", 0}, {"lambda", lambda}}};
}

Case concavity() {
  return {"a concavity",
          "concavity",
          slotted_disc,
          image_of([](const Vector<2>& x) { return smooth_step(slotted_disc(x), 0.15); }),
          notched_circle(),
          {{"minimal-surface", {minimal_surface(2)}},
           {"average-edge + willmore",
            {{"average-edge", 1, {{"lambda", 2}}}, {"willmore", 1e-4, {}}}}}};
}

/// An even slope all over the image, about as steep as the edge.
Case background() {
  return {
      "a varying background",
      "background",
      blob,
      image_of([](const Vector<2>& x) { return smooth_step(blob(x), 0.3) + 2 * (x[0] + x[1]); }),
      circle({0, 0}, 0.6),
      {{"minimal-surface", {minimal_surface(2)}},
       {"alignment + area", {{"alignment", 1, {{"sign", 1}, {"scale", 4}}}, {"area", 0.02, {}}}}}};
}

Case transition() {
  const std::vector<double> noise = texture();
  std::size_t at = 0;
  return {
      "a smooth transition",
      "transition",
      blob,
      image_of([&](const Vector<2>& x) { return smooth_step(blob(x), 0.6) + 0.1 * noise[at++]; }),
      circle({0, 0}, 0.8),
      {{"minimal-surface", {minimal_surface(2)}},
       {"chan-vese + area", {{"chan-vese", 1, {}}, {"area", 0.5, {}}}}}};
}

Case textures() {
  return {"two textures of equal mean",
          "textures",
          blob,
          textured(),
          circle({0.05, 0.05}, 0.7),
          {{"chan-vese + area", {{"chan-vese", 1, {}}, {"area", 0.15, {}}}},
           {"region-competition + area", {{"region-competition", 1, {}}, {"area", 0.15, {}}}}}};
}

/// Overlap with the object, 2 |A B| / (|A| + |B|).
double dice(const Case& one, const Segments& curves) {
  const auto mask = curve::rasterize(curves, {kPixels, kPixels}, one.image.pixel_to_plane());
  double both = 0, sum = 0;
  for (int j = 0; j < kPixels; ++j)
    for (int i = 0; i < kPixels; ++i) {
      const bool is_object = one.depth(unit_of(i, j)) > 0;
      const bool is_found = mask[std::size_t(j) * kPixels + i] != 0;
      both += is_object && is_found;
      sum += is_object + is_found;
    }
  return 2 * both / sum;
}

io::Picture picture_of(const Case& one, const Segments& curves) {
  constexpr int kScale = 2;
  io::Picture picture(kScale * kPixels, kScale * kPixels);
  const auto [low, high] =
      io::automatic_window({one.image.values().begin(), one.image.values().end()});
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const double value = one.image.value(x / kScale, y / kScale);
      const auto grey =
          static_cast<std::uint8_t>(255 * std::clamp((value - low) / (high - low), 0.0, 1.0));
      picture.at(x, y) = {grey, grey, grey};
    }
  const auto draw = [&](const Segments& shape, io::Color color) {
    io::Lines lines(picture.width(), picture.height());
    const auto at = [&](int i) -> Vector<2> {
      return kScale * (one.image.plane_to_pixel() * shape.points.row(i).transpose());
    };
    for (Eigen::Index t = 0; t < shape.elements.rows(); ++t)
      lines.add(at(shape.elements(t, 0)), at(shape.elements(t, 1)));
    lines.draw(picture, color);
  };
  draw(one.start, {96, 160, 255});
  draw(curves, io::kOutline);
  return picture;
}

}  // namespace

int main(int n_arguments, char** arguments) {
  const std::string directory = n_arguments > 1 ? arguments[1] : ".";
  fmt::print("| image | energy | Dice | steps | end |\n|---|---|---|---|---|\n");
  for (const Case& one : {concavity(), background(), transition(), textures()}) {
    io::Picture both(4 * kPixels + 8, 2 * kPixels, {255, 255, 255});
    int column = 0;
    for (const Model& model : one.models) {
      curve::CurveOptions options;
      options.initial = one.start;
      options.energies = model.terms;
      options.settle = false;
      const auto result = curve::segment(one.image, options);
      const auto& flow = result.last();
      fmt::print("| {} | {} | {:.3f} | {} | {} |\n", one.name, model.name, dice(one, result.shape),
                 flow.steps.size(), flow::to_string(flow.termination));
      std::fflush(stdout);
      both.paste(picture_of(one, result.shape), column, 0);
      column += 2 * kPixels + 8;
    }
    io::write_png(fmt::format("{}/model-{}.png", directory, one.file), both);
  }
}
