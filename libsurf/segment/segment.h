// From a volume and seeds to a surface: the stages of a run, put together from fields, energies,
// flows and the moving surface.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/flow/evolution.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/topology.h"
#include "libsurf/volume/image_fields.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

/// One term of the energy with its parameters by name; what is not given is chosen from the image
/// round the seeds.
///   minimal-surface  gamma0, gamma [1/mm], lambda [intensity/mm]: (5.1)
///   chan-vese        no parameters: 1.1.2, divided by the squared contrast
///   window           mean, half-width [intensity]: int_Omega of energy::intensity_window
///   area             beta of beta |Gamma| as `weight` [mm beside window or chan-vese]
struct EnergyTerm {
  std::string name;
  double weight = 1;
  std::map<std::string, double> parameters;
};

struct SegmentOptions {
  std::vector<Eigen::Vector3d> seeds_ras_mm;
  /// Radius of the seed balls [mm]; none = from the image round the seed.
  std::optional<double> seed_radius_mm;
  /// Initial surface in place of seed balls; seeds then only serve to choose parameters.
  std::optional<Triangles> initial_surface;

  /// Terms of the energy; empty = automatic: a ladder of intensity windows grown from the seeds
  /// (ladder.h).
  std::vector<EnergyTerm> energies;
  /// Gaussian smoothing [mm]; none = 0.7 voxel.
  std::optional<double> sigma_mm;
  double selective_sigma_mm = 0, selective_threshold = 0;
  volume::DerivativeFilter derivative_filter = volume::DerivativeFilter::kBSpline;

  /// Wanted edge length of the result where it is finest [mm]; none = 1.5 voxels.
  std::optional<double> edge_length_mm;
  /// Space adaptivity (mesh/adaptivity.h): edges may be this many times longer where geometry and
  /// data allow; 1 = uniform.
  double coarseness = 4;
  /// epsilon_geom of Alg. 6 [mm]; none = 1 voxel. On the ball of 128^3 the surface is then as close
  /// (0.028 voxel) as with uniform edges of 1.5 voxels, with an eighth of the triangles; half a
  /// voxel doubles these and changes nothing else.
  std::optional<double> geometry_tolerance_mm;
  /// epsilon_int of Alg. 7 per area, for the integrands on the surface; 0 = not used.
  double integral_tolerance = 0.016;
  /// What happens where sheets meet.
  mesh::Topology topology = mesh::Topology::kFree;
  /// See MovingSurfaceOptions; none = 0.7 of the edge length.
  std::optional<double> topology_resolution_mm;
  /// Distance at which sheets are held apart where they may not join [mm]; none = 0.7 of the edge
  /// length.
  std::optional<double> sheet_distance_mm;
  /// After explicit energies have come to rest: cavities where the domain part of the energy asks
  /// for them (nucleation.h), and on from there.
  bool open_cavities = false;
  /// Multi-resolution (the continuation of 5.2): level l of n_levels - 1, ..., 0 runs explicit
  /// energies with sigma, edge lengths and tolerances 2^l times those of the result, each from the
  /// surface of the level before. An expanding front may leak through what the blur of a coarse
  /// level hides, so 1 is the default.
  int n_levels = 1;
  flow::FlowOptions flow;
  /// Settle the surface on the edges it has found: a last stage with the edge indicator alone.
  bool settle = true;
  /// What stays of the final surface; `solids.seeds_ras_mm` is ignored, the seeds above count.
  mesh::SolidFilter solids;

  std::string error() const;  ///< empty if valid
};

struct StageReport {
  std::string name;
  flow::FlowSummary flow;
  double edge_length_mm = 0;
  double seconds = 0;
};

/// One of the surfaces that a run offers, best first.
struct Candidate {
  Triangles surface;
  double score = 0;  ///< larger is better; comparable within a run only
  double volume_mm3 = 0;
  std::vector<EnergyTerm> energies;  ///< with every parameter: runs again as explicit options
  std::string stage;                 ///< name of the StageReport that it comes from
};

struct SegmentResult {
  Triangles surface;
  std::vector<StageReport> stages;
  std::vector<Candidate> candidates;
  std::vector<EnergyTerm> energies;    ///< of the chosen surface, every parameter filled in
  std::vector<mesh::Removal> removed;  ///< of the final surface, see SegmentOptions::solids
  std::vector<std::string> notes;      ///< what a user should know
  double sigma_mm = 0, edge_length_mm = 0, seed_radius_mm = 0;
  double border_share = 0;  ///< share of the area on the volume's border
  const flow::FlowSummary& last() const { return stages.back().flow; }
  /// The stage that made the surface, before it settled: the chosen rung of a ladder, or the
  /// evolution of explicit energies. Needs at least one stage.
  const StageReport& main_stage() const;
};

/// Called after every step with the stage's name and the current surface (only valid during the
/// call); false stops the run with the surface as it is.
using Progress = std::function<bool(const std::string& stage, const flow::StepRecord& record,
                                    const std::function<Triangles()>& surface)>;

/// @throws UsageError  options.error() is not empty, a seed lies outside the volume, an energy
///                     or one of its parameters is unknown
SegmentResult segment(const volume::Volume& volume, const SegmentOptions& options,
                      const Progress& progress = {});

}  // namespace surf::segment
