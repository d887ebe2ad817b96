// Which elements of a shape to refine and which to coarsen: the indicators of thesis 4.2 and limits
// on lengths together, for curves and surfaces.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/fem/indicators.h"

namespace surf::fem {

template <int Dim>
struct AdaptivityOptions {
  /// Alg. 6: epsilon_geom for the sum of h_S theta_S over an element's sides [mm]; 0 = not used.
  /// The thesis takes 0.02 where lengths are of order 1 (5.1).
  double geometry_tolerance_mm = 0;
  /// Alg. 7: epsilon_int per length or area, for each of the integrands; 0 = not used. The
  /// thesis takes 0.2 on surfaces of area 4 pi: 0.016.
  double integral_tolerance = 0;
  std::vector<std::shared_ptr<const Field<Dim>>> integrands = {};
  double gamma_refine = 0.7;  ///< thesis 5.1
  /// In [0, gamma_refine); 0: nothing is coarsened. With the thesis' 0.3 a prism of 128^3 voxels
  /// needs 10 to 30 % more triangles for the same error.
  double gamma_coarsen = 0.65;

  /// Elements with a longer edge are refined whatever the indicators say [mm], > 0.
  double max_length_mm = 0;
  /// Elements without a longer edge are refined by the closure of bisection only [mm], 0 <=
  /// min_length_mm <= max_length_mm.
  double min_length_mm = 0;
  /// Elements, by their corners in rows, in which no edge may be longer than min_length_mm; none =
  /// there are no such elements.
  std::function<bool(const Eigen::Matrix<double, Dim, Dim>& corners)> is_fine = {};
  /// Elements, by their corners, that are neither refined nor coarsened; none = all may be.
  std::function<bool(const Eigen::Matrix<double, Dim, Dim>& corners)> rests = {};
  Eigen::Index max_elements = 2'000'000;

  std::string error() const;  ///< empty if valid
};

/// What an adaptation did.
struct AdaptivityReport {
  int n_rounds = 0;         ///< rounds that changed something
  int n_refined = 0;        ///< new vertices
  int n_coarsened = 0;      ///< removed vertices
  bool is_settled = false;  ///< the last round found nothing to change
  bool is_limited = false;  ///< max_elements kept something from being refined
};

/// What the indicators and the limits on lengths say of each element: refine if any says so,
/// coarsen if all do.
template <int Dim>
std::vector<Mark> adaptivity_marks(const Geometry<Dim>& shape,
                                   const AdaptivityOptions<Dim>& options);

/// The same with errors that are known, which otherwise are those of quadrature_error().
/// @param errors  (m, options.integrands); not looked at if options.integral_tolerance is 0
template <int Dim>
std::vector<Mark> adaptivity_marks(const Geometry<Dim>& shape,
                                   const AdaptivityOptions<Dim>& options,
                                   const Eigen::MatrixXd& errors);

}  // namespace surf::fem
