// What the image says round the seeds: intensity statistics and edge strength.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/search_grid.h"

namespace surf::segment {

/// Intensities in the largest ball round a seed that looks like one material.
struct SeedModel {
  double mean = 0;       ///< median of the ball
  double deviation = 0;  ///< 1.4826 MAD of the ball, at least the noise
  double noise = 0;      ///< 1.4826 median |second difference| / sqrt(6) near the seed
  double radius_mm = 0;  ///< of the ball
};

/// Grows a ball by one voxel at a time while 85 % of the next shell lies within 2.5 deviations,
/// the deviation stays below twice and the mean within one of its first values. The
/// deviation says little about the whole structure (2 to 180 times larger on real scans): use it as
/// the smallest meaningful step of a search, not as a model.
///
/// Samples lie on a lattice in the image's own frame about the cell nearest to each seed (all, if
/// several are): the same for every seed in a cell, and turned or flipped with the image.
/// @param I      intensities
/// @param seeds  world mm; the ball grows round all at once
template <int Dim>
SeedModel estimate_seed_model(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent);

/// The same at the nodes of a grid, "voxel" being a node: its noise is that which a search on the
/// grid meets, at least that of rounding. (Without it steps of one grey level in a clean image are
/// edges: a ball with an edge of 2 voxels ended where its intensity is first rounded down.)
template <int Dim>
SeedModel estimate_seed_model(const SearchGrid<Dim>& grid, const Vector<Dim>& seed);

/// The nodes of a grid of this size nearest to a point given in indices: one, or all that are
/// equally near, so that mirror images have mirrored ones. Clamped to the grid.
template <int Dim>
std::vector<std::array<int, Dim>> nearest_nodes(const Vector<Dim>& index,
                                                const std::array<int, Dim>& size);

/// Edge strength lambda for (5.1): a quarter of the median, over rays from the seeds, of the first
/// pronounced peak of |grad I|, but at least three times the median of |grad I| round the seeds,
/// within 1.5 or 3 cells, whichever is less, so that what varies there counts as no edge. Scales
/// with the intensities; does not look beyond the first edges. Rays that meet no such peak have no
/// say if a quarter of them do.
/// @return [intensity / mm], > 0
template <int Dim>
double estimate_edge_strength(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent);

/// About n directions, (n, Dim), nearly uniform, that are the same after any permutation and flip
/// of the axes: of the middles of the cells of a lattice, even in angle, on the edges of a square
/// or the faces of a cube.
template <int Dim>
Points<Dim> directions(int n);

/// The same in the image's own frame: turned or flipped with it.
template <int Dim>
Points<Dim> directions_in(const ImageExtent<Dim>& extent, int n);

/// The centres of the cells nearest to the seeds (of all that are equally near), where the image is
/// looked at: the same for every seed in a cell.
template <int Dim>
std::vector<Vector<Dim>> cell_centers(const ImageExtent<Dim>& extent,
                                      std::span<const Vector<Dim>> seeds);

double median(std::vector<double> values);

}  // namespace surf::segment
