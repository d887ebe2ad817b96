// One seed in an image, no options: the same curve is grown through a sequence of wider and wider
// intensity windows, and the rung just before a leak is kept. In a volume that would take minutes:
// see region_search.h. See docs/method.md for why.
#pragma once

#include "libsurf/segment/run.h"
#include "libsurf/segment/rung_features.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {

struct LadderOptions {
  mesh::MovingShapeOptions<2> shape;  ///< edge length of small objects; integrands are set here
  /// Neck radii r [cells]: the weight of the area is r / 2, so that a front does not pass a neck
  /// of smaller radius.
  std::vector<double> neck_radii = {1, 2, 4};
  int max_rungs = 24;
  /// Edge strengths lambda: for each, rungs of minimal-surface whose gamma grows from -0.1 to -0.57
  /// per cell. They cross weak edges that windows do not see apart from noise.
  std::vector<double> edge_strengths = {};
  flow::FlowOptions flow;
};

/// The initial curve for a neck radius [pixels]: circles below that radius would vanish.
using Start = std::function<Segments(double neck_radius)>;

/// Candidates of all rungs of all neck radii and edge strengths, best score first; empty if none
/// grew.
std::vector<CandidateOf<2>> climb(const Setting<2>& setting, EnergyModel<2>& model,
                                  const SeedModel& seed, const Start& starts,
                                  const LadderOptions& options, std::vector<StageReport>& stages,
                                  const ProgressOf<2>& progress);

}  // namespace surf::segment
