// One seed, no options: the same surface is grown through a sequence of wider and wider intensity
// windows, and the rung just before a leak is kept. See docs/method.md for why.
#pragma once

#include "libsurf/mesh/moving_surface.h"
#include "libsurf/segment/model.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {

/// What a rung's boundary looks like; all invariant to the image's and the world's unit.
struct RungFeatures {
  double volume_mm3 = 0;
  double separation = 0;    ///< 1 - overlap of the histograms inside and outside the boundary
  double edge_share = 0;    ///< share of the area that lies on a maximum of |grad I|
  double sphericity = 0;    ///< area of the ball of equal volume / area
  double growth_in = 0.7;   ///< ln V / V of the rung before
  double growth_out = 1.4;  ///< ln V of the rung after / V, at most 1.4
  /// separation * edge_share * sqrt(sphericity) * growth_out * exp(-growth_in / 4)
  double score() const;
};

struct LadderOptions {
  mesh::MovingSurfaceOptions
      surface;  ///< edge length of small objects; box and integrands are set here
  /// Neck radii r [voxels]: the weight of the area is r / 2, so that a front does not pass a neck
  /// of smaller radius.
  std::vector<double> neck_radii = {1, 2, 4};
  int max_rungs = 24;
  flow::FlowOptions flow;
};

/// The initial surface for a neck radius [voxels]: balls below that radius would vanish.
using Start = std::function<Triangles(double neck_radius)>;

/// Candidates of all rungs of all neck radii, best score first; empty if none grew.
std::vector<Candidate> climb(ImageModel& model, const SeedModel& seed, const Start& starts,
                             const LadderOptions& options, std::vector<StageReport>& stages,
                             const Progress& progress);

}  // namespace surf::segment
