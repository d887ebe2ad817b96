// One seed, no options: the same surface is grown through a sequence of wider and wider intensity
// windows, and the rung just before a leak is kept. See docs/method.md for why.
#pragma once

#include "libsurf/segment/run.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {

/// What a rung's boundary looks like; all invariant to the image's and the world's unit.
struct RungFeatures {
  double enclosed = 0;      ///< [mm^2] or [mm^3]
  double separation = 0;    ///< 1 - overlap of the histograms inside and outside the boundary
  double edge_share = 0;    ///< share of the length or area that lies on a maximum of |grad I|
  double sphericity = 0;    ///< measure of the ball of equal content / measure
  double growth_in = 0.7;   ///< ln V / V of the rung before, 3/2 of ln A / A in the plane
  double growth_out = 1.4;  ///< the same of the rung after, at most 1.4
  /// separation * edge_share * sqrt(sphericity) * growth_out * exp(-growth_in / 4)
  double score() const;
};

template <int Dim>
struct LadderOptions {
  ShapeOptions<Dim> shape;  ///< edge length of small objects; integrands are set here
  /// Neck radii r [cells]: the weight of the area is r / 2, so that a front does not pass a neck
  /// of smaller radius.
  std::vector<double> neck_radii = {1, 2, 4};
  int max_rungs = 24;
  /// Edge strengths lambda: for each, rungs of minimal-surface whose gamma grows from -0.1 to -0.57
  /// per cell. They cross weak edges that windows do not see apart from noise.
  std::vector<double> edge_strengths = {};
  flow::FlowOptions flow;
};

/// The initial shape for a neck radius [cells]: balls below that radius would vanish.
template <int Dim>
using Start = std::function<Simplices<Dim>(double neck_radius)>;

/// Candidates of all rungs of all neck radii and edge strengths, best score first; empty if none
/// grew.
template <int Dim>
std::vector<CandidateOf<Dim>> climb(const Setting<Dim>& setting, EnergyModel<Dim>& model,
                                    const SeedModel& seed, const Start<Dim>& starts,
                                    const LadderOptions<Dim>& options,
                                    std::vector<StageReport>& stages,
                                    const ProgressOf<Dim>& progress);

}  // namespace surf::segment
