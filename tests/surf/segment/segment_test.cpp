#include "libsurf/segment/segment.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

using Eigen::Vector3d;
using volume::PhantomKind;

constexpr int kSize = 48;

volume::PhantomOptions phantom(PhantomKind kind, double noise = 0) {
  volume::PhantomOptions options;
  options.kind = kind;
  options.size = {kSize, kSize, kSize};
  options.noise = noise;
  options.random_seed = 5;
  return options;
}

/// A point deep inside each body.
Vector3d inside(PhantomKind kind) {
  if (kind == PhantomKind::kTorus) return {0.5, 0, 0};
  return kind == PhantomKind::kTwoBalls ? Vector3d(0.4, 0, 0) : Vector3d::Zero();
}

/// (5.1) with a force of 0.65 per voxel: above the 2 / r that keeps the seed ball from shrinking,
/// below the steepest slope of ln H at an edge, about 1 per voxel.
SegmentOptions minimal_surface(PhantomKind kind) {
  constexpr double kVoxel = 2.0 / (kSize - 1);
  SegmentOptions options;
  options.seeds_mm = {inside(kind)};
  options.seed_radius_mm = kind == PhantomKind::kTorus ? 0.16 : 0.2;
  options.energies = {{"minimal-surface", 1, {{"gamma", -0.65 / kVoxel}}}};
  return options;
}

/// Verified, and close to the body in voxels.
void expect_found(const SegmentResult& result, const volume::PhantomOptions& options,
                  double tolerance, const std::string& name) {
  const mesh::Verification check = mesh::verify(result.shape);
  EXPECT_TRUE(check.passed()) << name << ": " << check.message();
  const double voxel = options.unit_mm() * 2 / (kSize - 1);
  const auto distances = mesh::distances_from(
      result.shape, [&](const Vector<3>& x) { return volume::phantom_distance_mm(options, x); },
      {.n_samples = 20000});
  fmt::print("{:<40} mean {:.3f} max {:.3f} signed {:+.3f} voxel, {} steps, {} triangles\n", name,
             distances.mean_mm / voxel, distances.max_mm / voxel, distances.signed_mean_mm / voxel,
             result.last().steps.size(), result.shape.elements.rows());
  EXPECT_LT(distances.mean_mm / voxel, tolerance) << name;
}

struct Way {
  std::string name;
  flow::ScalarProduct product;
  flow::Scheme scheme;
};
const std::vector<Way> kWays = {
    {"h1 explicit", flow::ScalarProduct::kH1, flow::Scheme::kExplicit},
    {"h1 semi-implicit", flow::ScalarProduct::kH1, flow::Scheme::kSemiImplicit},
    {"l2 explicit", flow::ScalarProduct::kL2, flow::Scheme::kExplicit},
    {"l2 semi-implicit", flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit}};

void expect_found_in_every_way(PhantomKind kind, double noise, double tolerance) {
  const auto options = phantom(kind, noise);
  const auto volume = volume::make_phantom(options);
  for (const Way& way : kWays) {
    SegmentOptions run = minimal_surface(kind);
    run.flow.velocity.product = way.product;
    run.flow.velocity.scheme = way.scheme;
    expect_found(segment(volume, run), options, tolerance, way.name);
  }
}

// The blur of variance s^2 (0.9 voxel^2 with the spline's) moves the steepest place of a ball's
// edge inside by s^2 / R = 0.064 voxel, and the facets lie another 0.015 inside.
constexpr double kBallTolerance = 0.1;

TEST(Segment, FindsTheBallWithEveryFlowAndScheme) {
  expect_found_in_every_way(PhantomKind::kBall, 0, kBallTolerance);
}

TEST(Segment, FindsTheNoisyBallWithEveryFlowAndScheme) {
  expect_found_in_every_way(PhantomKind::kBall, 0.1, 0.15);
}

TEST(Segment, FindsTheBoxWithEveryFlowAndScheme) {
  expect_found_in_every_way(PhantomKind::kBox, 0, 0.2);  // mostly the rounded corners
}

TEST(Segment, FindsTheTorusWithEveryFlowAndScheme) {
  // The fronts meet at the far side and are held apart there: the hole stays, a cut is left.
  expect_found_in_every_way(PhantomKind::kTorus, 0, 0.5);
}

TEST(Segment, FindsTheBallFromItsSeedAlone) {
  for (const double noise : {0.0, 0.1}) {
    const auto options = phantom(PhantomKind::kBall, noise);
    SegmentOptions run;
    run.seeds_mm = {Vector3d(0.15, -0.1, 0.2)};
    const SegmentResult result = segment(volume::make_phantom(options), run);
    expect_found(result, options, kBallTolerance, fmt::format("automatic, noise {}", noise));
    EXPECT_FALSE(result.proposals.empty());
    for (std::size_t i = 1; i < result.proposals.size(); ++i)
      EXPECT_GE(result.proposals[i - 1].score, result.proposals[i].score);
  }
}

// At an edge and a corner of the volume the caps of the grid's surface meet.
TEST(Segment, FindsWhatTheVolumeCutsOffFromItsSeedAlone) {
  for (const Vector3d& center : {Vector3d(0, 0, 20), Vector3d(0, 0, 0), Vector3d(39, 39, 39)}) {
    std::vector<float> values;
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i)
          values.push_back(
              float(0.5 - 0.5 * std::tanh((Vector3d(i, j, k) - center).norm() - 15.2)) +
              0.01f * float((3 * i + 5 * j + 7 * k) % 4));
    const volume::Volume volume({40, 40, 40}, Eigen::Affine3d::Identity(), values);
    // The ball's part in the voxels, which reach half a voxel beyond their centres: with R = 15.2
    // and h = 1/2 the quarter or eighth, slabs, bars, and at the corner a cube.
    constexpr double R = 15.2, h = 0.5, pi = std::numbers::pi;
    const double quarter = pi / 3 * R * R * R,
                 part = center[2] == 20
                            ? quarter + h * pi * R * R + 2 * h * h * R
                            : quarter / 2 + 3 * h * pi / 4 * R * R + 3 * h * h * R + h * h * h;
    for (const bool settle : {true, false}) {
      SegmentOptions run;
      run.settle = settle;
      run.seeds_mm = {center + (Vector3d(20, 20, 20) - center).normalized() * 6};
      const SegmentResult result = segment(volume, run);
      const mesh::Verification check = mesh::verify(result.shape);
      EXPECT_TRUE(check.passed()) << check.message();
      EXPECT_GE(check.min_angle_deg, 15);
      EXPECT_NEAR(mesh::volume_mm3(result.shape) / part, 1, settle ? 0.01 : 0.02);
      ASSERT_FALSE(result.proposals.empty());
      for (const auto& proposal : result.proposals)
        EXPECT_TRUE(mesh::verify(proposal.shape).passed());
    }
  }
}

TEST(Segment, FitsItsEnergyToAnInitialSurface) {
  const auto options = phantom(PhantomKind::kBall, 0.1);
  SegmentOptions run;
  run.initial = mesh::ball(Vector3d::Zero(), 0.55, 0.08);
  const SegmentResult result = segment(volume::make_phantom(options), run);
  expect_found(result, options, kBallTolerance, "fitted to an initial ball");
  EXPECT_EQ(result.outcome, Outcome::kConverged);
  EXPECT_TRUE(result.proposals.empty());
}

TEST(Segment, GrowsTwoBallsFromTwoSeeds) {
  auto options = phantom(PhantomKind::kTwoBalls);
  SegmentOptions run = minimal_surface(PhantomKind::kTwoBalls);
  run.seeds_mm = {Vector3d(-0.4, 0, 0), Vector3d(0.4, 0, 0)};
  // They touch: one surface where sheets may join, two where they may not.
  for (const auto& [topology, n_components] :
       {std::pair{mesh::Topology::kFree, 1u}, {mesh::Topology::kFixed, 2u}}) {
    run.topology = topology;
    const SegmentResult result = segment(volume::make_phantom(options), run);
    expect_found(result, options, 0.3, "two balls from two seeds");
    EXPECT_EQ(mesh::measure_components(result.shape).size(), n_components);
  }
}

TEST(Segment, MakesOneSurfaceOfThreeSeedsInABall) {
  const auto options = phantom(PhantomKind::kBall);
  SegmentOptions run = minimal_surface(PhantomKind::kBall);
  run.seeds_mm = {Vector3d(0.3, 0, 0), Vector3d(-0.25, 0.2, 0), Vector3d(0, -0.1, 0.3)};
  const SegmentResult result = segment(volume::make_phantom(options), run);
  expect_found(result, options, kBallTolerance, "ball from three seeds");
  const auto parts = mesh::measure_components(result.shape);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].genus(), 0);
}

TEST(Segment, FindsTheHandleOfATorusAndTheCavityOfAShell) {
  for (const auto& [kind, seed, genus, n_shells] :
       {std::tuple{PhantomKind::kTorus, Vector3d(0.5, 0, 0), 1, 1u},
        {PhantomKind::kShell, Vector3d(0.45, 0, 0), 0, 2u}}) {
    const auto options = phantom(kind);
    SegmentOptions run = minimal_surface(kind);
    run.seeds_mm = {seed};
    const SegmentResult result = segment(volume::make_phantom(options), run);
    expect_found(result, options, 0.3, "torus or shell");
    const auto parts = mesh::measure_components(result.shape);
    ASSERT_EQ(parts.size(), n_shells);
    int genera = 0;
    for (const auto& part : parts) genera += part.genus();
    EXPECT_EQ(genera, genus);
  }
}

TEST(Segment, LeavesOutASeedWhoseBallWouldTouchAnother) {
  SegmentOptions run = minimal_surface(PhantomKind::kBall);
  run.seeds_mm = {Vector3d::Zero(), Vector3d(0.05, 0, 0)};
  run.topology = mesh::Topology::kFixed;
  const SegmentResult result = segment(volume::make_phantom(phantom(PhantomKind::kBall)), run);
  ASSERT_FALSE(result.notes.empty());
  EXPECT_NE(result.notes[0].find("would touch another one"), std::string::npos);
  EXPECT_EQ(mesh::measure_components(result.shape).size(), 1u);
}

TEST(Segment, ShrinksAnInitialSurfaceFromOutside) {
  const auto options = phantom(PhantomKind::kBall);
  SegmentOptions run;
  run.initial = mesh::ball(Vector3d::Zero(), 0.9, 0.06);
  run.energies = {{"minimal-surface", 1, {{"gamma", 4}}}};
  expect_found(segment(volume::make_phantom(options), run), options, kBallTolerance,
               "ball from outside");
}

TEST(Segment, FindsTheBallWithChanVeseAndAWindow) {
  const auto options = phantom(PhantomKind::kBall);
  const auto volume = volume::make_phantom(options);
  for (const char* name : {"chan-vese", "window"}) {
    SegmentOptions run = minimal_surface(PhantomKind::kBall);
    run.energies = {{name, 1, {}}, {"area", 0.02, {}}};
    if (run.energies[0].name == "window")
      run.energies[0].parameters = {{"mean", 1}, {"half-width", 0.5}};
    expect_found(segment(volume, run), options, 0.15, name);
  }
}

TEST(Segment, StopsOnRequestWithASoundSurface) {
  SegmentOptions run = minimal_surface(PhantomKind::kBall);
  int n_steps = 0;
  const SegmentResult result =
      segment(volume::make_phantom(phantom(PhantomKind::kBall)), run,
              [&](const std::string&, const flow::StepRecord&, const auto& surface) {
                EXPECT_TRUE(mesh::verify(surface()).passed());
                return ++n_steps < 3;
              });
  EXPECT_EQ(n_steps, 3);
  EXPECT_EQ(result.stages.size(), 1u);
  EXPECT_EQ(result.last().termination, flow::Termination::kStopped);
  EXPECT_TRUE(mesh::verify(result.shape).passed());
}

TEST(Segment, FillsInEveryParameterSoThatTheRunCanBeRepeated) {
  const auto volume = volume::make_phantom(phantom(PhantomKind::kBall));
  SegmentOptions run = minimal_surface(PhantomKind::kBall);
  const SegmentResult first = segment(volume, run);
  ASSERT_EQ(first.energies.size(), 1u);
  EXPECT_EQ(first.energies[0].parameters.size(), 3u);
  run.energies = first.energies;
  run.seed_radius_mm = first.seed_radius_mm;
  run.sigma_mm = first.sigma_mm;
  run.edge_length_mm = first.edge_length_mm;
  EXPECT_EQ(segment(volume, run).shape.points, first.shape.points);
}

TEST(Segment, RefusesOptionsThatAreWrong) {
  const auto volume = volume::make_phantom(phantom(PhantomKind::kBall));
  SegmentOptions outside;
  outside.seeds_mm = {Vector3d(5, 0, 0)};
  EXPECT_THROW(segment(volume, outside), UsageError);
  EXPECT_THROW(segment(volume, {}), UsageError);
  SegmentOptions negative = minimal_surface(PhantomKind::kBall);
  negative.seed_radius_mm = -1;
  EXPECT_THROW(segment(volume, negative), UsageError);
  SegmentOptions unknown = minimal_surface(PhantomKind::kBall);
  unknown.energies[0].name = "snake";
  EXPECT_THROW(segment(volume, unknown), UsageError);
}

// Nothing of a box's corners may be left: with curvatures along shortened normals spikes were.
TEST(Segment, WillmoreMakesABallOfABox) {
  SegmentOptions options;
  options.initial = mesh::box({-0.6, -0.35, -0.35}, {0.6, 0.35, 0.35}, 0.06);
  options.energies = {{"willmore", 1, {}}};
  const SegmentResult result = segment(volume::make_phantom(phantom(PhantomKind::kBall)), options);
  const Eigen::RowVector3d centre = mesh::centroid(result.shape).transpose();
  const Eigen::VectorXd radii = (result.shape.points.rowwise() - centre).rowwise().norm();
  EXPECT_LT(radii.maxCoeff() / radii.minCoeff(), 1.08);
  const double ratio = radii.maxCoeff() / radii.mean();
  EXPECT_LT(ratio, 1.05) << "a spike";
}

SegmentOptions from_outside(int n_levels) {
  SegmentOptions options;
  options.initial = mesh::ball(Vector3d::Zero(), 0.9, 0.15);
  options.energies = {{"minimal-surface", 1, {{"gamma", 0}, {"lambda", 4}}}};
  options.n_levels = n_levels;
  return options;
}

TEST(Segment, LevelsEndAtTheSameSurfaceWithFewerStepsOnTheLast) {
  const auto scene = phantom(PhantomKind::kBox, 0.05);
  const volume::Volume image = volume::make_phantom(scene);
  const SegmentResult one = segment(image, from_outside(1));
  const SegmentResult two = segment(image, from_outside(2));
  ASSERT_EQ(two.stages.size(), 4u);  // a level, the last, the settling and the offset
  EXPECT_EQ(two.stages[0].name, "level 1");
  EXPECT_EQ(two.stages[0].edge_length_mm, 2 * two.edge_length_mm);
  EXPECT_EQ(two.main_stage()->name, "evolve");
  EXPECT_LT(two.last().steps.size(), one.last().steps.size());
  expect_found(one, scene, 0.2, "box, 1 level");
  expect_found(two, scene, 0.2, "box, 2 levels");
  const double voxel = image.voxel_size();
  EXPECT_LT(mesh::surface_distances(one.shape, two.shape).mean_mm, 0.1 * voxel);
}

TEST(Segment, ALevelTooCoarseForItsStartIsPassedOver) {
  const auto scene = phantom(PhantomKind::kBall);
  SegmentOptions options = minimal_surface(PhantomKind::kBall);
  options.n_levels = 4;  // edges of 12 voxels on the first; the seed ball's radius is 4.7 voxels
  const SegmentResult result = segment(volume::make_phantom(scene), options);
  ASSERT_FALSE(result.notes.empty());
  EXPECT_NE(result.notes.front().find("level 3"), std::string::npos) << result.notes.front();
  expect_found(result, scene, 0.1, "ball, 4 levels");
}

}  // namespace
}  // namespace surf::segment
