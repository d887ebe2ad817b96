// The region term of a start: what lies just inside of it against what lies just outside.
#pragma once

#include <memory>

#include "libsurf/mesh/neighbourhood.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

struct LocalMeansOptions {
  /// How far the shape may be from the start [mm], > 0; local means are over 4/3 of it.
  double reach_mm = 1;
  /// Standard deviation of the edges' blur [mm], >= 0, that of the field's own smoothing included:
  /// what lies nearer than two of it to the shape belongs to neither side.
  double edge_mm = 0;
  /// Of the intensities: means that differ by less are not told apart. > 0
  double noise = 1;
};

/// f with int_Omega f dx the region term of local means, dimensionless:
///
///   f = -tanh(q - 8 max(v, 0)^3) + 8 z u + 3/2 z^9,
///   q = (2 I - m_1 - m_2) c / m, v = (I - m_1) c / m, c = m_1 - m_2, m = c^2 + (2 noise)^2,
///   z = d / reach, u = (4 noise)^4 / (c^4 + (4 noise)^4)
///
/// m_1 and m_2 are the means of I inside and outside the start under a Gaussian of deviation 4/3
/// reach round each point, m_2 no further from m_1 than 1.25 times the median of that along the
/// start; d is the distance to the start, negative inside: within about reach of it the intensities
/// decide, beyond nothing does. u is about 1 where the means hardly differ:
/// there the shape is held at the start. This is the local Chan-Vese model (Lankton and
/// Tannenbaum, Localizing region-based active contours, 2008), bounded, with statistics that stay
/// while the shape moves: J is one functional.
///
/// I is the field itself; m_1, m_2 and d are C^2 splines on a grid round the start, as fine as a
/// cell or as the edges are wide, with at most kMostNodes nodes.
/// @param start   m_1 and m_2 are of its sides, d is the distance to it
/// @param region  where the shape moves: the grid is round what of the start lies in it; null =
///                everywhere
/// @throws UsageError  the start holds no node of that grid: it is too thin
template <int Dim>
std::shared_ptr<const Field<Dim>> local_means(const Setting<Dim>& setting,
                                              std::shared_ptr<const Field<Dim>> I,
                                              const Simplices<Dim>& start,
                                              const LocalMeansOptions& options,
                                              const mesh::Neighbourhood<Dim>* region = nullptr);

}  // namespace surf::segment
