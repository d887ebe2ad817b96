// What the image says round the seeds: intensity statistics and edge strength.
#pragma once

#include <span>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/segment/energy_model.h"

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
/// @param I        intensities
/// @param seeds    world mm; the ball grows round the first, means are over all
/// @param cell_mm  ImageExtent::cell_mm(): the "voxel" above
template <int Dim>
SeedModel estimate_seed_model(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              double cell_mm);

/// Edge strength lambda for (5.1): a quarter of the median, over rays from the seeds, of the first
/// pronounced peak of |grad I|, but at least three times the median of |grad I| round the seeds, so
/// that what varies there counts as no edge. Scales with the intensities; does not look beyond the
/// first edges.
/// @return [intensity / mm], > 0
template <int Dim>
double estimate_edge_strength(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent);

/// n uniform directions in the plane, or nearly uniform ones in space (Fibonacci lattice), (n,
/// Dim).
template <int Dim>
Points<Dim> directions(int n);

double median(std::vector<double> values);

}  // namespace surf::segment
