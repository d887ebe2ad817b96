#include "libcurve/segment/stack.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/volume/phantom.h"

namespace surf::curve {
namespace {

constexpr double kRadius = 0.6 * 19.5;  // of the ball, in voxels of 1 mm round 0, 0, 0

VoxelSlices ball_slices() {
  volume::PhantomOptions options;
  options.size = {40, 40, 40};
  options.spacing_mm = Eigen::Vector3d(1, 1, 1);
  return {volume::make_phantom(options), SlicePlane::kAxial};
}

/// From a circle in the middle of the first slice.
CurveOptions options_for(const VoxelSlices& slices) {
  const Image image = slices.slice(20);
  CurveOptions out;
  out.initial = circle(image.pixel_to_plane() * Vector<2>(20, 20), 8, 1);
  out.energies = {{"chan-vese", 1, {}}, {"area", 0.1, {}}};
  return out;
}

double area_of(const SliceContours& slice) {
  return fem::Geometry<2>(slice.curves.points, slice.curves.elements).enclosed();
}

TEST(Stack, FollowsTheObjectBothWays) {
  const VoxelSlices slices = ball_slices();
  for (const int last : {26, 14}) {
    const StackResult stack = segment_stack(slices, 20, last, options_for(slices));
    ASSERT_EQ(stack.slices.size(), 7u);
    EXPECT_TRUE(stack.notes.empty());
    EXPECT_EQ(stack.n_limited, 0);
    for (std::size_t n = 0; n < stack.slices.size(); ++n) {
      const int k = stack.slices[n].slice;
      EXPECT_EQ(k, last > 20 ? 20 + int(n) : 20 - int(n));
      const double z = k - 19.5, area = M_PI * (kRadius * kRadius - z * z);
      EXPECT_NEAR(area_of(stack.slices[n]), area, 0.03 * area) << k;
    }
  }
}

TEST(Stack, EndsBeforeTheSliceThatHasNoObject) {
  const VoxelSlices slices = ball_slices();
  const StackResult stack = segment_stack(slices, 20, 39, options_for(slices));
  ASSERT_FALSE(stack.slices.empty());
  EXPECT_LT(stack.slices.back().slice, 36);
  ASSERT_EQ(stack.notes.size(), 1u);
  EXPECT_NE(stack.notes[0].find("the stack ends before it"), std::string::npos);
  EXPECT_FALSE(stack.is_invalid);
}

TEST(Stack, IsRefusedAtOnceWhereThereIsNoLastSlice) {
  const VoxelSlices slices = ball_slices();
  int n_steps = 0;
  EXPECT_THROW(segment_stack(slices, 20, 400, options_for(slices),
                             [&](int, const std::string&, const flow::StepRecord&) {
                               ++n_steps;
                               return true;
                             }),
               InputError);
  EXPECT_EQ(n_steps, 0);
}

TEST(Stack, StopsOnRequestWithTheSliceAsItIs) {
  const VoxelSlices slices = ball_slices();
  const StackResult stack =
      segment_stack(slices, 20, 26, options_for(slices),
                    [](int slice, const std::string&, const auto&) { return slice < 22; });
  EXPECT_EQ(stack.slices.size(), 3u);
}

TEST(Stack, CountsSlicesThatEndAtTheLimitOfSteps) {
  const VoxelSlices slices = ball_slices();
  CurveOptions options = options_for(slices);
  options.flow.max_steps = 1;
  options.settle = false;
  EXPECT_GT(segment_stack(slices, 20, 21, options).n_limited, 0);
}

TEST(Stack, LabelsAreTheVoxelsWhoseCentresLieInside) {
  const VoxelSlices slices = ball_slices();
  const StackResult stack = segment_stack(slices, 19, 21, options_for(slices));
  const auto labels = rasterized(stack.slices, slices);
  const auto label = [&](int i, int j, int k) { return labels[(k * 40 + j) * 40 + i]; };
  EXPECT_EQ(label(20, 20, 20), 1);
  EXPECT_EQ(label(20, 20, 22), 0);  // not segmented
  EXPECT_EQ(label(2, 20, 20), 0);
  int n = 0;
  for (const auto voxel : labels) n += voxel;
  double area = 0;
  for (const SliceContours& slice : stack.slices) area += area_of(slice);
  EXPECT_NEAR(n, area, 0.02 * area);
}

TEST(Stack, RefusesSlicesThatTheVolumeDoesNotHave) {
  const VoxelSlices slices = ball_slices();
  EXPECT_THROW(segment_stack(slices, 40, 41, options_for(slices)), InputError);
}

}  // namespace
}  // namespace surf::curve
