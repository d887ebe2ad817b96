// Objects that the border of the volume cuts off.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "libsurf/base/error.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/segment.h"

namespace surf::segment {
namespace {

using Eigen::Vector3d;

constexpr int kSize = 40;
constexpr double kRadius = 15, kEdgeWidth = 1.6;  // voxels, those of the phantom of 64^3

/// A ball of the phantoms' profile whose centre lies `depth` voxels from the outer faces of the
/// voxels along `n_faces` axes, and in the middle along the others. One voxel is 1 mm.
struct CutBall {
  int n_faces;
  double depth = 6, noise = 0;

  Vector3d centre() const {
    Vector3d out = Vector3d::Constant((kSize - 1) / 2.0);
    out.head(n_faces).setConstant(depth - 0.5);
    return out;
  }
  volume::Volume volume() const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<float> values;
    for (int k = 0; k < kSize; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i) {
          const double depth_mm = kRadius - (Vector3d(i, j, k) - centre()).norm();
          const double t = std::clamp(depth_mm / kEdgeWidth, -1.0, 1.0);
          const double value = (1 + t + std::sin(std::numbers::pi * t) / std::numbers::pi) / 2;
          values.push_back(float(value + (noise > 0 ? noise * normal(random) : 0)));
        }
    return {{kSize, kSize, kSize}, Eigen::Affine3d::Identity(), values};
  }
  /// Of a ball round the centre within the voxels, column by column.
  double exact_volume(double radius = kRadius) const {
    constexpr double kStep = 1.0 / 16;
    const Vector3d c = centre();
    double sum = 0;
    for (double x = -0.5 + kStep / 2; x < kSize - 0.5; x += kStep)
      for (double y = -0.5 + kStep / 2; y < kSize - 0.5; y += kStep) {
        const double squared = radius * radius - std::pow(x - c[0], 2) - std::pow(y - c[1], 2);
        if (squared <= 0) continue;
        const double half = std::sqrt(squared);
        sum += std::max(0.0, std::min(c[2] + half, kSize - 0.5) - std::max(c[2] - half, -0.5));
      }
    return sum * kStep * kStep;
  }
};

/// What of a surface does not lie on the outer faces of the voxels.
Triangles off_the_border(const Triangles& surface, const ImageBox<3>& box) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index t = 0; t < surface.elements.rows(); ++t) {
    std::uint8_t common = 0xff;
    for (int i = 0; i < 3; ++i)
      common &= box.faces(surface.points.row(surface.elements(t, i)).transpose());
    if (common == 0) rows.push_back(t);
  }
  return {surface.points, surface.elements(rows, Eigen::all)};
}

constexpr double kDistance = 0.06;  // mm; noise alone roughens the uncut ball by 0.04 to 0.05

/// The surface is verified, and what does not lie on the border is the ball of a radius.
void expect_ball(const CutBall& scene, const SegmentOptions& options, double radius,
                 const std::string& name) {
  const volume::Volume volume = scene.volume();
  const SegmentResult result = segment(volume, options);
  const mesh::Verification check = mesh::verify(result.shape);
  EXPECT_TRUE(check.passed()) << name << ": " << check.message();
  const Vector3d c = scene.centre();
  const ImageBox<3> box{volume.size(), volume.index_to_world(), volume.world_to_index()};
  const auto distances = mesh::distances_from(
      off_the_border(result.shape, box),
      [&](const Vector<3>& x) { return (x - c).norm() - radius; }, {.n_samples = 20000});
  const double excess = mesh::volume_mm3(result.shape) / scene.exact_volume(radius) - 1;
  fmt::print("{:<46} volume {:+.2f} %, mean {:.3f} max {:.3f} signed {:+.3f}, {} steps: {}\n", name,
             100 * excess, distances.mean_mm, distances.max_mm, distances.signed_mean_mm,
             result.n_steps(), result.message);
  EXPECT_LT(std::abs(excess), 0.01) << name;
  EXPECT_LT(distances.mean_mm, kDistance) << name;
}

/// The ball that the energy finds where nothing is cut off: it has a bias of its own.
/// @param options  get the energy with all its parameters
/// @return  its radius
double radius_without_border(double noise, double offset, SegmentOptions& options) {
  const CutBall scene{0, 6, noise};
  options.seeds_mm = {scene.centre()};
  options.initial = mesh::ball(scene.centre(), kRadius + offset, 1.5);
  const SegmentResult result = segment(scene.volume(), options);
  options.energies = result.energies;
  return std::cbrt(mesh::volume_mm3(result.shape) * 3 / (4 * std::numbers::pi));
}

const std::vector<std::pair<std::string, std::vector<EnergyTerm>>> kEnergies = {
    {"minimal-surface", {{"minimal-surface", 1, {{"gamma", 0}}}}},
    {"chan-vese + area", {{"chan-vese", 1, {}}, {"area", 0.01, {}}}},
    {"window + area", {{"window", 1, {{"mean", 1}, {"half-width", 0.5}}}, {"area", 0.05, {}}}}};

class CutObject : public ::testing::TestWithParam<int> {
 protected:
  /// From a larger and a smaller ball.
  static void expect_same_ball(double noise, const std::string& energy,
                               const std::vector<EnergyTerm>& terms) {
    for (const double offset : {-2.0, 2.0}) {
      const CutBall scene{GetParam(), 6, noise};
      SegmentOptions options;
      options.energies = terms;
      options.settle = false;
      if (noise > 0) options.sigma_mm = 1.5;
      const double radius = radius_without_border(noise, offset, options);
      options.seeds_mm = {scene.centre()};
      options.initial = mesh::ball(scene.centre(), kRadius + offset, 1.5);
      expect_ball(
          scene, options, radius,
          fmt::format("{} faces, noise {}, {}, {:+}", scene.n_faces, noise, energy, offset));
    }
  }
};

TEST_P(CutObject, EndsOnTheBorderAsIfItWentOn) {
  for (const auto& [energy, terms] : kEnergies) expect_same_ball(0, energy, terms);
}

TEST_P(CutObject, EndsOnTheBorderUnderNoiseAsIfItWentOn) {
  for (const auto& [energy, terms] : kEnergies)
    if (energy != "minimal-surface") expect_same_ball(0.1, energy, terms);
}

TEST_P(CutObject, EndsOnTheBorderUnderNoiseByMinimalSurfaceAlone) {
  if (GetParam() > 1)
    GTEST_SKIP()
        << "minimal-surface that does not settle, under noise at an edge or a corner of the "
           "volume: 1.0 to 1.1 % too large, 0.07 to 0.10 voxel off (docs/method.md, \"Where the "
           "volume ends\")";
  expect_same_ball(0.1, kEnergies[0].first, kEnergies[0].second);
}

TEST_P(CutObject, IsFoundFromItsSeedAlone) {
  for (const double noise : {0.0, 0.1})
    for (const char* energy : {"", "minimal-surface"}) {
      const CutBall scene{GetParam(), 6, noise};
      SegmentOptions options;
      options.seeds_mm = {scene.centre()};
      if (*energy) options.energies = {{energy, 1, {}}};
      expect_ball(
          scene, options, kRadius,
          fmt::format("{} faces, noise {}, from its seed {}", scene.n_faces, noise, energy));
    }
}

/// The volume within a frame of one value.
volume::Volume padded(const volume::Volume& volume, int by, float value) {
  const int size = kSize + 2 * by;
  std::vector<float> values;
  for (int k = -by; k < kSize + by; ++k)
    for (int j = -by; j < kSize + by; ++j)
      for (int i = -by; i < kSize + by; ++i) {
        const bool is_within = std::min({i, j, k}) >= 0 && std::max({i, j, k}) < kSize;
        values.push_back(is_within ? volume.value(i, j, k) : value);
      }
  return {
      {size, size, size}, Eigen::Affine3d(Eigen::Translation3d(Vector3d::Constant(-by))), values};
}

TEST_P(CutObject, IsFoundInAPaddedScanAsInTheScan) {
  const CutBall scene{GetParam(), 6, 0.1};
  SegmentOptions options;
  options.seeds_mm = {scene.centre()};
  const volume::Volume scan = scene.volume();
  const SegmentResult alone = segment(scan, options);
  ASSERT_FALSE(alone.proposals.empty());
  for (const float value : {-10.f, 0.f, 3.f}) {
    const SegmentResult result = segment(padded(scan, 9, value), options);
    ASSERT_FALSE(result.proposals.empty());
    EXPECT_NEAR(result.proposals[0].enclosed, alone.proposals[0].enclosed,
                1e-3 * alone.proposals[0].enclosed)
        << value;
    ASSERT_TRUE(result.verdict && alone.verdict);
    EXPECT_EQ(result.verdict->trust, alone.verdict->trust) << value;
    EXPECT_NEAR(mesh::volume_mm3(result.shape), mesh::volume_mm3(alone.shape),
                1e-3 * mesh::volume_mm3(alone.shape))
        << value;
  }
  // Nothing was scanned there.
  options.outside_mm = {Vector3d(-5, 6, 6)};
  EXPECT_THROW(segment(padded(scan, 9, -10), options), UsageError);
}

INSTANTIATE_TEST_SUITE_P(FaceEdgeAndCorner, CutObject, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace surf::segment
