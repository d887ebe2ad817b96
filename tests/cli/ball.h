// The ball that most tests of `surfseg segment` find.
#pragma once

#include <cmath>

#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/primitives.h"
#include "tests/cli/rows.h"

namespace surfseg::test {

/// A ball of radius 0.6 * 19.5 mm in 40^3 voxels of 1 mm: phantom.h.
inline constexpr double kRadiusMm = 0.6 * 19.5;
inline const double kVolumeMm3 = 4.0 / 3 * M_PI * std::pow(kRadiusMm, 3);
/// A shell of 0.15 mm on the ball: what Dice > 0.98 allows.
inline const double kVolumeToleranceMm3 = 0.04 * kVolumeMm3;

class BallTest : public Program {
 protected:
  void make_ball(const Words& more = {}) const {
    must(joined({"phantom", "ball", "--size", "40", "-o", "ball.nii.gz"},
                more.empty() ? Words{"--spacing", "1"} : more));
  }
  static Words segment(const Words& more) {
    return joined({"segment", "ball.nii.gz", "--seed", "0,0,0", "-q"}, more);
  }
  /// Dice with the ball itself: its voxels alone are 1 % off at this size, for they count only
  /// where their centres lie.
  double dice(const std::string& surface) const {
    constexpr double kFineMm = 0.4;  // chords take 0.1 % of the volume
    surf::io::write_surface(file("truth.vtp"), surf::mesh::ball({0, 0, 0}, kRadiusMm, kFineMm));
    must({"evaluate", surface, "--reference", "truth.vtp", "--json", "e.json"});
    return json("e.json")["dice"];
  }
};

}  // namespace surfseg::test
