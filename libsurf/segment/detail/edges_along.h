// What the edges along a shape look like.
#pragma once

#include "libsurf/segment/fields.h"

namespace surf::segment {

struct EdgesAlong {
  double blur_mm = 0;     ///< deviation s of a Gaussian that makes steps such edges
  double sigma_mm = 0;    ///< smoothing, no more than noise asks for
  double slope = 0;       ///< median steepest |d_nu I| at this smoothing [intensity/mm], > 0
  double noise = 0;       ///< deviation of I at this smoothing [intensity], > 0
  double nearest_mm = 0;  ///< of edges_round(): from the seeds to the edges or the image's border
};

/// Looks along the normals of a shape, at most `reach` to either side for the edge, and as far
/// again for what lies beside it.
///
/// *Blur.* The steepest slope g across a step that is blurred by s and by a smoothing of sigma is
/// proportional to (s^2 + sigma^2)^(-1/2): with rho = (g_1 / g_2)^2 at two of them,
///
///   s^2 = (sigma_2^2 - rho sigma_1^2) / (rho - 1).
///
/// Edges are the steepest places at sigma_2 = 2 sigma_1, g their median slope with its sign, so
/// that noise counts as slope only as far as it chose the places: by about its deviation n. The
/// wider the edges, the less two narrow blurs flatten them, and the more of rho is noise. So
/// sigma_1 is the least of 0.4, 0.8, ... cells at which g > kClear n and 2 n / g is at most
/// a fifth of rho - 1, or the one where it is the least share. n is taken from the slopes, or
/// from their differences to those at sigma_2 where these say less, as along edges wider than the
/// profiles. The blur does not depend on how finely the image is sampled, as long as its edges are
/// no sharper than its cells.
///
/// *Smoothing.* The least of these sigma at which the noise moves an edge by no more than a tenth
/// of its whole blur, at most s, or 0.8 cells if that is more; by no more than 3 % where s is above
/// two cells. The noise is that of all slopes, and of such wide edges that of the slopes further
/// than 2.5 deviations of the blur from them.
///
/// @return  blur between 0.3 and 8 cells; 0.5 cells where no edge stands out
template <int Dim>
EdgesAlong edges_along(Fields<Dim>& fields, const Options<Dim>& options,
                       const Simplices<Dim>& shape, double reach_mm);

/// The same along rays from the seeds, of the first pronounced peak of the slope on each, and with
/// 0.7 cells as the least smoothing; g_2 is measured at the edges that are seen at 2 sigma_2. Wide
/// edges are smoothed until their slopes are 18 times the noise's, too. What the options give needs
/// no looking at: slope and noise are 0 where they give sigma, the nearest edge where they give the
/// radius of the seeds' balls.
template <int Dim>
EdgesAlong edges_round(Fields<Dim>& fields, const Options<Dim>& options,
                       const std::vector<Vector<Dim>>& seeds);

}  // namespace surf::segment
