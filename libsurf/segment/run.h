// The stages of a run, the same for curves in an image and surfaces in a volume.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libsurf/fem/adaptivity.h"
#include "libsurf/flow/evolution.h"
#include "libsurf/mesh/topology.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/volume/image_fields.h"

namespace surf::segment {

/// What runs on images and on volumes have in common. Points and lengths are in the world: RAS mm
/// of a volume, mm of an image's plane. "Cell" is a pixel or voxel.
template <int Dim>
struct RunOptions {
  std::vector<Vector<Dim>> seeds_mm;
  /// Radius of the seed circles or balls [mm]; none = from the image round the seed.
  std::optional<double> seed_radius_mm;
  /// Initial shape in place of seed balls; seeds then only serve to choose parameters. Like the
  /// radius not used where the object is looked for in space.
  std::optional<Simplices<Dim>> initial;

  /// Terms of the energy; empty = automatic: the object that stands out round the seeds is looked
  /// for among openings of intensity windows on a grid (proposal.h), and settled on its edges.
  std::vector<EnergyTerm> energies;
  /// Gaussian smoothing [mm]; none = 0.7 cells.
  std::optional<double> sigma_mm;
  double selective_sigma_mm = 0, selective_threshold = 0;
  volume::DerivativeFilter derivative_filter = volume::DerivativeFilter::kBSpline;

  /// Wanted edge length of the result where it is finest [mm]; none = 1.5 cells.
  std::optional<double> edge_length_mm;
  /// Space adaptivity (fem/adaptivity.h): edges may be this many times longer where geometry and
  /// data allow; 1 = uniform.
  double coarseness = 4;
  /// epsilon_geom of Alg. 6 [mm]; none = 1 cell. On the ball of 128^3 the surface is then as close
  /// (0.028 voxel) as with uniform edges of 1.5 voxels, with an eighth of the triangles; half a
  /// voxel doubles these and changes nothing else.
  std::optional<double> geometry_tolerance_mm;
  /// epsilon_int of Alg. 7 per area or length, for the integrands on the shape; 0 = not used.
  double integral_tolerance = 0.016;
  /// What happens where sheets meet.
  mesh::Topology topology = mesh::Topology::kFree;
  /// What is thinner is joined or cut [mm]; none = 0.7 of the edge length.
  std::optional<double> topology_resolution_mm;
  /// Distance at which sheets are held apart where they may not join [mm]; none = 0.7 of the edge
  /// length.
  std::optional<double> sheet_distance_mm;
  /// After explicit energies have come to rest: holes where the domain part of the energy asks
  /// for them (nucleation.h), and on from there.
  bool open_cavities = false;
  /// Multi-resolution (the continuation of 5.2): level l of n_levels - 1, ..., 0 runs explicit
  /// energies with sigma, edge lengths and tolerances 2^l times those of the result, each from the
  /// shape of the level before. An expanding front may leak through what the blur of a coarse
  /// level hides, so 1 is the default.
  int n_levels = 1;
  /// Of mumford-shah in the plane with an L2 or H1 flow: at most so many steps of each coarse stage
  /// (Alg. 17); 0 = none.
  int n_coarse_steps = 150;  // thesis 5.2
  flow::FlowOptions flow;
  /// Settle the shape on the edges it has found: a last stage with the edge indicator alone. Not
  /// where the flow keeps the content.
  bool settle = true;

  std::string error() const;  ///< empty if valid
};

struct StageReport {
  std::string name;
  flow::FlowSummary flow;
  double edge_length_mm = 0;
  double seconds = 0;
};

/// One of the shapes that a run offers, best first.
template <int Dim>
struct CandidateOf {
  Simplices<Dim> shape;
  double score = 0;                  ///< larger is better; comparable within a run only
  double enclosed = 0;               ///< area [mm^2] or volume [mm^3]
  std::vector<EnergyTerm> energies;  ///< window and area, with every parameter
  std::string stage;                 ///< name of the StageReport that it comes from
};

template <int Dim>
struct RunResult {
  Simplices<Dim> shape;
  std::vector<StageReport> stages;
  std::vector<CandidateOf<Dim>> candidates;
  std::vector<EnergyTerm> energies;  ///< of the chosen shape, every parameter filled in
  std::vector<std::string> notes;    ///< what a user should know
  double sigma_mm = 0, edge_length_mm = 0, seed_radius_mm = 0;
  double border_share = 0;  ///< share of the length or area on the image's border
  const flow::FlowSummary& last() const { return stages.back().flow; }
  /// The stage that made the shape, before it settled: the search,
  /// or the evolution of explicit energies. Needs at least one stage.
  const StageReport& main_stage() const;
};

/// Called after every step with the stage's name and the current shape (only valid during the
/// call); false stops the run with the shape as it is.
template <int Dim>
using ProgressOf = std::function<bool(const std::string& stage, const flow::StepRecord& record,
                                      const std::function<Simplices<Dim>()>& shape)>;

/// What a run asks of a moving shape: the options that curves and surfaces share.
template <int Dim>
struct ShapeOptions {
  double edge_length_mm = 1;
  double coarseness = 1;
  fem::AdaptivityOptions<Dim> adaptivity = {};
  double max_displacement_mm = std::numeric_limits<double>::infinity();
  /// Curves only: see MovingCurveOptions.
  std::shared_ptr<const Field<Dim>> edge_indicator;
  double path_spacing_mm = 0;
  mesh::Topology topology = mesh::Topology::kFixed;
  double topology_resolution_mm = 0;
  double sheet_distance = 0.7;

  /// @param Options  MovingSurfaceOptions or MovingCurveOptions
  template <class Options>
  Options to() const {
    Options out;
    out.edge_length_mm = edge_length_mm;
    out.coarseness = coarseness;
    out.adaptivity = adaptivity;
    out.max_displacement_mm = max_displacement_mm;
    if constexpr (Dim == 2) {
      out.edge_indicator = edge_indicator;
      out.path_spacing_mm = path_spacing_mm;
    }
    out.topology = topology;
    out.topology_resolution_mm = topology_resolution_mm;
    out.sheet_distance = sheet_distance;
    return out;
  }
};

/// A moving curve or surface as a run sees it.
template <int Dim>
class GrowingShape {
 public:
  virtual ~GrowingShape() = default;
  virtual flow::MovingShape<Dim>& moving() = 0;
  virtual Simplices<Dim> simplices() const = 0;
  virtual double border_share() const = 0;
  virtual bool is_limited() const = 0;
  virtual void set_edge_length(double edge_length_mm) = 0;
  virtual void set_integrands(std::vector<std::shared_ptr<const Field<Dim>>> integrands) = 0;
};

/// Curves in an image, or surfaces in a volume: what a run needs of either. Thread-safe.
template <int Dim>
class Setting {
 public:
  virtual ~Setting() = default;
  virtual const ImageExtent<Dim>& extent() const = 0;
  virtual std::unique_ptr<EnergyModel<Dim>> make_model(
      const volume::SmoothingOptions& smoothing) const = 0;
  virtual std::unique_ptr<GrowingShape<Dim>> make_shape(const Simplices<Dim>& start,
                                                        const ShapeOptions<Dim>& options) const = 0;

  virtual Simplices<Dim> ball(const Vector<Dim>& center, double radius,
                              double edge_length) const = 0;
  virtual Simplices<Dim> joined(const std::vector<Simplices<Dim>>& parts) const = 0;
  virtual Simplices<Dim> flipped(const Simplices<Dim>& shape) const = 0;
  /// 1 for the cells of a grid inside the shape, first index fastest.
  virtual std::vector<std::uint8_t> rasterized(
      const Simplices<Dim>& shape, const std::array<int, Dim>& size,
      const Eigen::Transform<double, Dim, Eigen::Affine>& index_to_world) const = 0;
  virtual bool is_embedded(const Simplices<Dim>& shape) const = 0;
  /// Where the values at the nodes of a grid, first index fastest, are above a level; half a step
  /// outside where the grid ends. Closed and outward, but it may intersect itself.
  virtual Simplices<Dim> shape_of_level(
      std::span<const float> values, const std::array<int, Dim>& size,
      const Eigen::Transform<double, Dim, Eigen::Affine>& index_to_world, double level) const = 0;
  /// The shape moved to `to`, but for what would then intersect.
  virtual Simplices<Dim> moved(const Simplices<Dim>& shape, const Points<Dim>& to) const = 0;
  /// "curve" or "surface"
  virtual const char* noun() const = 0;
};

/// Chooses what the options leave open, evolves, settles.
/// @param options  valid, and their seeds in the image
template <int Dim>
RunResult<Dim> run(const Setting<Dim>& setting, const RunOptions<Dim>& options,
                   const ProgressOf<Dim>& progress);

}  // namespace surf::segment
