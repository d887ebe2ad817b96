// What may be asked of a segmentation, the same for curves in an image and surfaces in a volume.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libsurf/flow/evolution.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/topology.h"
#include "libsurf/segment/click.h"
#include "libsurf/segment/energy_term.h"
#include "libsurf/volume/image_fields.h"

namespace surf::segment {

/// What stays of the final shape.
struct ComponentOptions {
  bool fill_cavities = false;  ///< first: cavities or holes go, with all that lies in them
  double min_content = 0;      ///< then components of less [mm^Dim], with their cavities
  mesh::Keep keep = mesh::Keep::kAll;

  std::string error() const;  ///< empty if valid
};

/// Of one object. Points and lengths are in the world: RAS mm of a volume, mm of an image's plane.
/// "Cell" is a pixel or voxel.
template <int Dim>
struct Options {
  /// Inside clicks for the short way, segment(); a Segmentation has its own.
  std::vector<Vector<Dim>> seeds_mm;
  /// Outside clicks, likewise.
  std::vector<Vector<Dim>> outside_mm = {};
  /// Sides of both in the order in which they were clicked; empty = the seeds first.
  std::vector<Side> click_order = {};
  /// A box that the object lies in, a centimetre or two larger than it; what is looked for without
  /// an energy lies in it.
  std::optional<BoxCorners<Dim>> box_mm = {};
  /// Where the image is looked at for parameters if there is no inside click, such as the middle of
  /// an initial shape; the object need not have these points.
  std::vector<Vector<Dim>> samples_mm = {};
  /// Radius of the seed circles or balls [mm]; none = from the image round the seed.
  std::optional<double> seed_radius_mm;
  /// The shape to start from, in place of seed balls or of what would be proposed.
  std::optional<Simplices<Dim>> initial;

  /// Terms of the energy; empty = automatic: regions are proposed round the clicks
  /// (region_search.h), and local-means and minimal-surface are fitted to the chosen one
  /// (stages/fit.h).
  std::vector<EnergyTerm> energies;
  /// Gaussian smoothing [mm]; none = from the noise and the width of the edges.
  std::optional<double> sigma_mm;
  double selective_sigma_mm = 0, selective_threshold = 0;
  volume::DerivativeFilter derivative_filter = volume::DerivativeFilter::kBSpline;
  volume::Interpolation interpolation = volume::Interpolation::kSpline;

  /// Wanted edge length of the result where it is finest [mm]; none = 1.5 cells, or 1.5 times the
  /// blur of the edges if that is more.
  std::optional<double> edge_length_mm;
  /// Space adaptivity (fem/adaptivity.h): edges may be this many times longer where geometry and
  /// data allow; 1 = uniform.
  double coarseness = 4;
  /// epsilon_geom of Alg. 6 [mm]; none = 1 cell, or the blur of the edges if that is more. On the
  /// ball of 128^3 the surface is then as close (0.028 voxel) as with uniform edges of 1.5 voxels,
  /// with an eighth of the triangles; half a voxel doubles these and changes nothing else.
  std::optional<double> geometry_tolerance_mm;
  /// epsilon_int of Alg. 7 per area or length, for the integrands on the shape; 0 = not used.
  double integral_tolerance = 0.016;
  /// gamma_R and gamma_C of Alg. 6 (fem::AdaptivityOptions); 0 <= gamma_coarsen < gamma_refine
  /// <= 1.
  double gamma_refine = 0.7, gamma_coarsen = 0.65;
  /// What happens where sheets meet.
  mesh::Topology topology = mesh::Topology::kFree;
  /// What is thinner is joined or cut [mm]; none = 0.7 of the edge length.
  std::optional<double> topology_resolution_mm;
  /// Distance at which sheets are held apart where they may not join [mm]; none = 0.7 of the edge
  /// length.
  std::optional<double> sheet_distance_mm;
  /// After the energy has come to rest: holes where its domain part asks for them (nucleation.h),
  /// and on from there.
  bool open_cavities = false;
  /// Multi-resolution (the continuation of 5.2): level l of n_levels - 1, ..., 0 runs with sigma,
  /// edge lengths and tolerances 2^l times those of the result, each from the shape of the level
  /// before. An expanding front may leak through what the blur of a coarse level hides, so 1 is the
  /// default.
  int n_levels = 1;
  /// Of piecewise smooth models with an L2 or H1 flow: at most so many steps of the coarse stage
  /// (Alg. 17); 0 = neither it nor the loop after it.
  int n_coarse_steps = Dim == 2 ? 150 : 0;  // thesis 5.2, which is in the plane
  /// C_coarse, by which geometry_tolerance_mm is larger there, and C_2 of the loop; >= 1.
  double coarse_geometry = 3, continued_geometry = 2;  // thesis 5.2
  /// d_1 and d_2 over flow.rel_tol: down to what share of its largest value |dJ| falls before the
  /// tolerance is that of the result, and that of C_2; 0 < first <= second.
  double first_threshold = 5, second_threshold = 20;  // thesis 5.2
  /// Where |dJ| grows again the loop goes back to fixed steps, and to C_2.
  bool continuation_returns = true;
  flow::FlowOptions flow;
  /// Settle the shape on the edges it has found: a last stage with the edge indicator alone. Not
  /// where the flow keeps the content.
  bool settle = true;
  /// At last: a blurred step is fitted to the cells along the shape, which moves on to it where
  /// there is one and comes to know how sure its place is (locate_edges.h). None = where the energy
  /// is chosen by the image, unless settle is off.
  std::optional<bool> locate;
  ComponentOptions components;

  std::string error() const;  ///< empty if valid
};

}  // namespace surf::segment
