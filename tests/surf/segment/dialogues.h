// Dialogues about phantoms in 40^3 voxels.
#pragma once

#include "libsurf/segment/segment.h"
#include "libsurf/segment/segmentation.h"
#include "tests/surf/segment/phantoms.h"

namespace surf::segment {

inline volume::Volume phantom(volume::PhantomKind kind = volume::PhantomKind::kBall,
                              double noise = 0) {
  return test::phantom(kind, 40, noise);
}

inline Segmentation<3> ball() { return Segmentation<3>(make_setting(phantom())); }

inline Click<3> inside(double x, double y = 0, double z = 0) { return {{x, y, z}, Side::kInside}; }
inline Click<3> outside(double x, double y = 0, double z = 0) {
  return {{x, y, z}, Side::kOutside};
}

}  // namespace surf::segment
