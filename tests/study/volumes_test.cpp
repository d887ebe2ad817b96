// Thesis 5.1.3 on volumes of 48^3 voxels; docs/adaptivity.md has it at 128^3. Beside each
// bound stands what was measured.
#include <gtest/gtest.h>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/verify.h"
#include "tests/bench/volume_experiments.h"

namespace surf::bench {
namespace {

constexpr int kSize = 48;

struct Found {
  segment::SegmentResult result;
  mesh::DistanceStatistics to_body;  // of the surface [mm]
  double voxel_mm;
};

Found run(volume::PhantomKind kind) {
  volume::PhantomOptions phantom = phantom_of(kind, kSize);
  phantom.edge_width_mm = 2 * 2.0 / kSize;  // two voxels
  const volume::Volume image = volume::make_phantom(phantom);
  Found out{segment::segment(image, options_of_thesis(image.voxel_size())), {}, image.voxel_size()};
  out.to_body = mesh::distances_from(out.result.shape, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  });
  return out;
}

// Fig. 5.24: the surface closes in on both balls and into the cusp where they touch.
TEST(VolumesStudy, FindsTwoTouchingBallsIntoTheCusp) {
  const Found balls = run(volume::PhantomKind::kTwoBalls);
  EXPECT_EQ(balls.result.last().termination, flow::Termination::kConverged);
  EXPECT_TRUE(mesh::verify(balls.result.shape).passed());
  EXPECT_LE(balls.result.n_steps(), 42);                   // 35
  EXPECT_LT(balls.result.last().final_energy, 1.08);       // 1.055
  EXPECT_LT(balls.to_body.mean_mm, 0.9 * balls.voxel_mm);  // 0.78
  EXPECT_LT(balls.to_body.max_mm, 1.5 * balls.voxel_mm);   // 1.28
}

// Fig. 5.25
TEST(VolumesStudy, FindsAPrismFromASphere) {
  const Found prism = run(volume::PhantomKind::kBox);
  EXPECT_EQ(prism.result.last().termination, flow::Termination::kConverged);
  EXPECT_TRUE(mesh::verify(prism.result.shape).passed());
  EXPECT_LE(prism.result.n_steps(), 38);                   // 31
  EXPECT_LT(prism.result.last().final_energy, 1.04);       // 1.016
  EXPECT_LT(prism.to_body.mean_mm, 0.9 * prism.voxel_mm);  // 0.76
  EXPECT_LT(prism.to_body.max_mm, 3.6 * prism.voxel_mm);   // 3.08, at the corners
}

}  // namespace
}  // namespace surf::bench
