// Objects that the border of the image cuts off.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"
#include "libsurf/flow/content.h"

namespace surf::curve {
namespace {

constexpr int kSize = 40;
constexpr double kRadius = 15, kEdgeWidth = 1.6;  // pixels

/// A disc whose centre lies 6 pixels from the outer sides of the pixels along n_sides axes. One
/// pixel is 1 mm.
struct CutDisc {
  int n_sides;
  double noise = 0;

  Vector<2> centre() const {
    Vector<2> out = Vector<2>::Constant((kSize - 1) / 2.0);
    out.head(n_sides).setConstant(5.5);
    return out;
  }
  Image image() const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<float> values;
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        const double depth = kRadius - (Vector<2>(i, j) - centre()).norm();
        const double t = std::clamp(depth / kEdgeWidth, -1.0, 1.0);
        const double value = (1 + t + std::sin(std::numbers::pi * t) / std::numbers::pi) / 2;
        values.push_back(float(value + (noise > 0 ? noise * normal(random) : 0)));
      }
    return {{kSize, kSize}, pixel_to_plane({1, 1}), values};
  }
  double exact_area() const {
    constexpr double kStep = 1e-3;
    double sum = 0;
    for (double x = -0.5 + kStep / 2; x < kSize - 0.5; x += kStep) {
      const double squared = kRadius * kRadius - std::pow(x - centre()[0], 2);
      const double half = std::sqrt(std::max(squared, 0.0)), y = centre()[1];
      sum += std::max(0.0, std::min(y + half, kSize - 0.5) - std::max(y - half, -0.5));
    }
    return sum * kStep;
  }
};

/// Mean distance of what does not lie on the pixels' outer sides from the circle.
double mean_distance(const Segments& curves, const CutDisc& scene, const ImageBox<2>& box) {
  double sum = 0, length = 0;
  for (const auto& t : curves.elements.rowwise()) {
    const Vector<2> a = curves.points.row(t[0]), b = curves.points.row(t[1]);
    if ((box.faces(a) & box.faces(b)) != 0) continue;
    for (double s = 0.05; s < 1; s += 0.1)
      sum +=
          0.1 * (b - a).norm() * std::abs(((1 - s) * a + s * b - scene.centre()).norm() - kRadius);
    length += (b - a).norm();
  }
  return sum / length;
}

const std::vector<std::pair<std::string, std::vector<segment::EnergyTerm>>> kEnergies = {
    {"minimal-surface", {{"minimal-surface", 1, {{"gamma", 0}}}}},
    {"chan-vese + area", {{"chan-vese", 1, {}}, {"area", 0.01, {}}}},
    {"window + area", {{"window", 1, {{"mean", 1}, {"half-width", 0.5}}}, {"area", 0.05, {}}}}};

TEST(CutObject, EndsOnTheBorderOfTheImageAsIfItWentOn) {
  for (const int n_sides : {1, 2})
    for (const double noise : {0.0, 0.1})
      for (const auto& [energy, terms] : kEnergies)
        for (const double offset : {-2.0, 2.0}) {
          const CutDisc scene{n_sides, noise};
          const Image image = scene.image();
          const ImageBox<2> box{image.size(), image.pixel_to_plane(), image.plane_to_pixel()};
          CurveOptions options;
          options.seeds_mm = {scene.centre()};
          options.initial = circle(scene.centre(), kRadius + offset, 1.5);
          options.energies = terms;
          options.settle = energy == "minimal-surface";  // whose minimiser has a bias of its own
          if (noise > 0) options.sigma_mm = 1.5;
          const CurveResult result = segment(image, options);
          const std::string name =
              fmt::format("{} sides, noise {}, {}, {:+}", n_sides, noise, energy, offset);
          EXPECT_TRUE(verify(result.shape).passed()) << name;
          const double excess =
              flow::content<2>(result.shape.points, result.shape.elements) / scene.exact_area() - 1;
          const double distance = mean_distance(result.shape, scene, box);
          fmt::print("{:<46} area {:+.2f} %, mean {:.3f}, {} steps, {} ({})\n", name, 100 * excess,
                     distance, result.last().steps.size(), to_string(result.last().termination),
                     result.last().message);
          EXPECT_LT(std::abs(excess), 0.01) << name;
          EXPECT_LT(distance, noise > 0 ? 0.2 : 0.06) << name;  // a line averages less than an area
        }
}

}  // namespace
}  // namespace surf::curve
