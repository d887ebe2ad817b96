#include "libsurf/segment/detail/edges_along.h"

#include <gtest/gtest.h>

#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

EdgesAlong edges_of(int size, double noise, double radius = 0.6) {
  volume::PhantomOptions options;
  options.size = {size, size, size};
  options.noise = noise;
  Fields<3> fields(make_setting(volume::make_phantom(options)));
  const double voxel = 2.0 / (size - 1);
  return edges_along<3>(fields, {}, mesh::ball(Vector<3>::Zero(), radius, 2 * voxel), 4 * voxel);
}

// The phantom's edge has the slope 20 per mm: that of a step blurred by 0.02 mm.
constexpr double kBlur = 0.02;

TEST(EdgesAlong, HaveTheSameWidthHoweverFinelyTheyAreSampled) {
  EXPECT_NEAR(edges_of(96, 0).blur_mm, kBlur, 0.2 * kBlur);
  EXPECT_NEAR(edges_of(160, 0).blur_mm, kBlur, 0.15 * kBlur);
}

TEST(EdgesAlong, AreFoundBesideTheShapeToo) {
  EXPECT_NEAR(edges_of(128, 0, 0.6 - 2 * 2.0 / 127).blur_mm, kBlur, 0.2 * kBlur);
}

TEST(EdgesAlong, AskForMoreSmoothingUnderNoise) {
  const EdgesAlong clean = edges_of(96, 0), noisy = edges_of(96, 0.2);
  EXPECT_GT(noisy.sigma_mm, clean.sigma_mm);
  EXPECT_GT(noisy.noise, 100 * clean.noise);
}

// Across the border of the volume nothing changes: it says nothing of noise or slopes.
TEST(EdgesAlong, AreNotMeasuredAcrossTheBorder) {
  volume::PhantomOptions options;
  options.size = {64, 64, 64};
  options.noise = 0.1;
  const volume::Volume whole = volume::make_phantom(options);
  const double voxel = 2.0 / 63;
  std::vector<float> values(64 * 64 * 12);  // slices through the middle
  whole.copy_box({0, 0, 26}, {64, 64, 38}, values.data());
  Eigen::Affine3d header = whole.index_to_world();
  header.translate(Vector<3>(0, 0, 26));
  Fields<3> fields(make_setting(whole)), of_slices(make_setting({{64, 64, 12}, header, values}));
  Triangles cut = mesh::ball(Vector<3>::Zero(), 0.6, 2 * voxel);
  for (Eigen::Index i = 0; i < cut.points.rows(); ++i)
    cut.points.row(i) =
        of_slices.setting().extent().clamped(cut.points.row(i).transpose()).transpose();
  Options<3> options_now;
  options_now.sigma_mm = voxel;  // noise is that which this leaves
  const EdgesAlong all = edges_along<3>(fields, options_now,
                                        mesh::ball(Vector<3>::Zero(), 0.6, 2 * voxel), 4 * voxel),
                   some = edges_along<3>(of_slices, options_now, cut, 4 * voxel);
  EXPECT_NEAR(some.noise, all.noise, 0.3 * all.noise);
  EXPECT_NEAR(some.slope, all.slope, 0.3 * all.slope);
}

/// A ball whose edge is that of a step blurred by 0.1 mm, 3.2 voxels.
Fields<3> wide_edges(double noise) {
  volume::PhantomOptions options;
  options.size = {64, 64, 64};
  options.edge_width_mm = 0.25;
  options.noise = noise;
  return Fields<3>(make_setting(volume::make_phantom(options)));
}
constexpr double kWideBlur = 0.1;

// At narrow smoothing the steepest places are those where noise adds to the slope.
TEST(EdgesAlong, AreNoNarrowerForNoise) {
  EXPECT_NEAR(edges_of(160, 0.1).blur_mm, kBlur, 0.15 * kBlur);
  Fields<3> fields = wide_edges(0.1);
  const Triangles shape = mesh::ball(Vector<3>::Zero(), 0.6, 0.06);
  EXPECT_NEAR(edges_along<3>(fields, {}, shape, 0.1).blur_mm, kWideBlur, 0.1 * kWideBlur);
}

// Profiles that reach no further than the edge would take its slopes for noise.
TEST(EdgesAlong, AreNoNoiseHoweverWide) {
  Fields<3> fields = wide_edges(0);
  const EdgesAlong edges =
      edges_along<3>(fields, {}, mesh::ball(Vector<3>::Zero(), 0.6, 0.06), 0.1);
  EXPECT_NEAR(edges.blur_mm, kWideBlur, 0.1 * kWideBlur);
  EXPECT_LT(edges.noise, 1e-3);
}

// Rays from the ball's centre, whose slopes but for the edge are rounding.
TEST(EdgesRound, AreFoundInAnImageWithoutNoise) {
  for (const int size : {64, 128}) {
    volume::PhantomOptions options;
    options.size = {size, size, size};
    Fields<3> fields(make_setting(volume::make_phantom(options)));
    const EdgesAlong edges = edges_round<3>(fields, {}, {Vector<3>::Zero()});
    EXPECT_NEAR(edges.blur_mm, kBlur, 0.4 * kBlur) << size;
    EXPECT_GT(edges.slope, 5) << size;
  }
}

TEST(EdgesRound, KeepTheSmoothingThatIsGivenAndHaveTheSameBlur) {
  volume::PhantomOptions options;
  options.size = {64, 64, 64};
  Fields<3> fields(make_setting(volume::make_phantom(options)));
  const EdgesAlong free = edges_round<3>(fields, {}, {Vector<3>::Zero()});
  Options<3> given;
  given.sigma_mm = 0.1;
  const EdgesAlong edges = edges_round<3>(fields, given, {Vector<3>::Zero()});
  EXPECT_EQ(edges.sigma_mm, 0.1);
  EXPECT_EQ(edges.blur_mm, free.blur_mm);
  EXPECT_GT(edges.nearest_mm, 0);
  given.seed_radius_mm = 0.2;
  EXPECT_EQ(edges_round<3>(fields, given, {Vector<3>::Zero()}).blur_mm, free.blur_mm);
  EXPECT_EQ(edges_round<3>(fields, given, {Vector<3>::Zero()}).nearest_mm, 0) << "not looked for";
}

// From a click in the air beside a ball: under wide blurs slopes are 0 to the last digit.
TEST(EdgesRound, EndWhereWiderBlursSeeNothing) {
  volume::PhantomOptions options;
  options.size = {32, 32, 32};
  options.spacing_mm = {1, 1, 1};
  Fields<3> fields(make_setting(volume::make_phantom(options)));
  const EdgesAlong edges = edges_round<3>(fields, {}, {Vector<3>(-14, 0, 0)});
  EXPECT_TRUE(std::isfinite(edges.blur_mm));
  EXPECT_LT(edges.sigma_mm, 10);
  EXPECT_GT(edges.slope, 0);
}

TEST(EdgesRound, AreNowhereInAConstantImage) {
  const volume::Volume constant({32, 32, 32}, Eigen::Affine3d::Identity(),
                                std::vector<float>(32 * 32 * 32, 7));
  Fields<3> fields(make_setting(constant));
  const EdgesAlong edges = edges_round<3>(fields, {}, {Vector<3>(15, 15, 15)});
  EXPECT_EQ(edges.blur_mm, 0.5);
  EXPECT_GT(edges.slope, 0);
}

TEST(EdgesAlong, ScaleWithTheIntensities) {
  volume::PhantomOptions options;
  options.size = {48, 48, 48};
  options.noise = 0.1;
  const volume::Volume one = volume::make_phantom(options);
  std::vector<float> values(one.n_voxels());
  one.copy_box({0, 0, 0}, one.size(), values.data());
  for (float& value : values) value = 1000 * value - 300;
  const volume::Volume other(one.size(), one.index_to_world(), values);
  const Triangles shape = mesh::ball(Vector<3>::Zero(), 0.6, 0.08);
  Fields<3> a(make_setting(one)), b(make_setting(other));
  const EdgesAlong first = edges_along<3>(a, {}, shape, 0.1),
                   second = edges_along<3>(b, {}, shape, 0.1);
  EXPECT_NEAR(second.blur_mm, first.blur_mm, 1e-3 * first.blur_mm);
  EXPECT_EQ(second.sigma_mm, first.sigma_mm);
  EXPECT_NEAR(second.slope, 1000 * first.slope, first.slope);
  EXPECT_NEAR(second.noise, 1000 * first.noise, first.noise);
}

}  // namespace
}  // namespace surf::segment
