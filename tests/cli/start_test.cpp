// Where a run starts: seeds in any space, boxes, bodies.
#include <algorithm>
#include <tuple>

#include "libsurf/volume/write_volume.h"
#include "tests/cli/ball.h"

namespace surfseg::test {
namespace {

class Start : public BallTest {};

// The ball in its box, whichever corners and space, and by recipe and summary again.
TEST_F(Start, FindsABallInItsBox) {
  make_ball({"--spacing", "1", "--noise", "0.1"});
  must(segment(
      {"--box", "-16,-16,-16,16,16,16", "-o", "s.vtp", "--json", "s.json", "--recipe", "r.json"}));
  EXPECT_GT(dice("s.vtp"), 0.98);
  must(segment({"--box", "16,16,-16,-16,-16,16", "--space", "lps", "-o", "lps.vtp", "-q"}));
  EXPECT_EQ(bytes("lps.vtp"), bytes("s.vtp"));
  must({"segment", "ball.nii.gz", "--config", "s.json", "-o", "again.vtp", "-q"});
  EXPECT_EQ(bytes("again.vtp"), bytes("s.vtp"));
  must({"replay", "r.json", "-o", "third.vtp", "-q"});
  EXPECT_EQ(bytes("third.vtp"), bytes("s.vtp"));
  const Outcome idle = must({"segment", "ball.nii.gz", "--seed", "0,0,0", "--box",
                             "-16,-16,-16,16,16,16", "--energy", "minimal-surface", "-o", "e.vtp"});
  EXPECT_NE(idle.err.find("--box has no effect"), std::string::npos) << idle.err;
}

TEST_F(Start, SeedsOfEverySpaceGiveTheSameSurface) {
  make_ball();
  const auto from = [&](const char* space, const char* seed, const char* name) {
    must({"segment", "ball.nii.gz", "--space", space, "--seed", seed, "-q", "-o", name});
    return bytes(name);
  };
  const std::string ras = from("ras", "-2.5,1.5,3.5", "a.stl");
  EXPECT_EQ(from("lps", "2.5,-1.5,3.5", "b.stl"), ras);
  EXPECT_EQ(from("ijk", "17,21,23", "c.stl"), ras);  // voxel 0 is at -19.5 mm
}

// Half a ball of 8 voxels' radius about the middle of a face, clicked in a voxel that lies there:
// the volume reaches to its voxels' outer faces. The voxel's centre is (1/3, 14/3, 29/7) mm.
TEST_F(Start, SeedsInTheOuterHalfOfABorderVoxelAreInTheVolume) {
  constexpr int kSize = 24;
  constexpr double kRadius = 8, kSpacingMm = 1.0 / 3;
  const Eigen::Vector3d center(-0.5, 12, 12);
  std::vector<float> values;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        const double depth = kRadius - (Eigen::Vector3d(i, j, k) - center).norm();
        values.push_back(float(std::clamp(depth + 0.5, 0.0, 1.0)));
      }
  surf::volume::write_volume(file("half.nii"),
                             surf::volume::Volume({kSize, kSize, kSize},
                                                  Eigen::Translation3d(1.0 / 3, 2.0 / 3, 1.0 / 7) *
                                                      Eigen::Affine3d(Eigen::Scaling(kSpacingMm)),
                                                  values));
  const double expected = 2.0 / 3 * M_PI * std::pow(kRadius * kSpacingMm, 3);
  for (const auto& [space, seed] : {std::pair{"ijk", "-0.3,12,12"},
                                    {"ijk", "-0.499,12,12"},
                                    {"ras", "0.333333,4.666667,4.142857"}}) {
    // Edges of a voxel and a half are long for a ball of eight.
    must({"segment", "half.nii", "--space", space, "--seed", seed, "--edge-length", "0.9vox", "-o",
          "s.stl", "--json", "s.json", "-q"});
    EXPECT_NEAR(json("s.json")["volume_mm3"], expected, 0.01 * expected) << seed;
  }
  EXPECT_EQ(run({"segment", "half.nii", "--space", "ijk", "--seed", "-0.51,12,12", "-o", "s.stl"})
                .exit_code,
            2);
}

TEST_F(Start, InitialBodiesReachTheSameBall) {
  make_ball();
  for (const auto& [option, value] : std::vector<std::pair<const char*, const char*>>{
           {"--initial-ball", "1,0,0,6mm"},
           {"--initial-ellipsoid", "1,0,0,7mm,5vox,6mm"},
           {"--initial-box", "-5,-4,-5,5,4,6"}}) {
    must({"segment", "ball.nii.gz", option, value, "-q", "-o", "s.stl"});
    EXPECT_GT(dice("s.stl"), 0.98) << option;
  }
}

/// In a mirrored grid of unequal spacing, bodies given in voxels are outward in the world too;
/// the surface is written before the first step.
TEST_F(Start, InitialBodiesInVoxelsFollowTheGrid) {
  make_ball({"--spacing", "1,1,1.5", "--direction", "-1,0,0,0,1,0,0,0,1"});
  for (const auto& [option, value, expected] :
       std::vector<std::tuple<std::string, std::string, double>>{
           {"--initial-ellipsoid", "19.5,19.5,19.5,5mm,4mm,6mm", 4.0 / 3 * M_PI * 5 * 4 * 6},
           {"--initial-box", "16,17,16,23,22,23", 7.0 * 5 * 7 * 1.5}}) {
    run({"segment", "ball.nii.gz", "--space", "ijk", option, value, "-q", "-o", "s.stl", "--json",
         "s.json", "--max-iterations", "0", "--no-settle", "--energy", "area"});
    EXPECT_EQ(json("s.json")["outward"], true) << option;
    constexpr double kChords = 0.1;  // edges of 1.7 mm cut the ellipsoid's caps off
    EXPECT_NEAR(json("s.json")["volume_mm3"], expected, kChords * expected) << option;
  }
}

}  // namespace
}  // namespace surfseg::test
