// Phantoms to segment.
#pragma once

#include "libsurf/volume/phantom.h"

namespace surf::test {

/// In size^3 voxels.
inline volume::Volume phantom(volume::PhantomKind kind, int size, double noise) {
  volume::PhantomOptions options;
  options.kind = kind;
  options.size = {size, size, size};
  options.noise = noise;
  return volume::make_phantom(options);
}

/// Apart along the first axis, with noise.
inline volume::Volume two_balls() { return phantom(volume::PhantomKind::kSeparateBalls, 40, 0.05); }

}  // namespace surf::test
