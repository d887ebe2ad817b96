// Indicators for space adaptivity, thesis 4.2: where a shape needs more elements, and where fewer
// do. One value per element; curves and surfaces alike.
#pragma once

#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/fem/geometry.h"

namespace surf::fem {

/// Geometric variation of each element, 4.2.1: eta_T = sum over its sides S of h_S theta_S [mm],
/// (m).
///
/// A side of a triangle is an edge of length h_S, that of a segment a node, with h_S the mean
/// length of its two segments; theta_S is the angle between the normals of the two elements at S.
/// The shape lies within about max h_S theta_S / 8 of a smooth one through its vertices.
/// @pre the shape is closed
template <int Dim>
Eigen::VectorXd geometric_variation(const Geometry<Dim>& shape);

/// Quadrature error of each element, 4.2.2: eta_T = |I~_f(T) - I_f(T)|, the difference of the
/// integrals of f over T by two rules, (m) [unit of f * mm^(Dim-1)].
/// @param order, higher_order  as quadrature(); order < higher_order
template <int Dim>
Eigen::VectorXd quadrature_error(const Geometry<Dim>& shape, const Field<Dim>& f, int order = 2,
                                 int higher_order = 5);

/// The same of some elements, in the order of their list.
template <int Dim>
Eigen::VectorXd quadrature_error(const Geometry<Dim>& shape, const std::vector<Eigen::Index>& of,
                                 const Field<Dim>& f, int order = 2, int higher_order = 5);

/// What is to be done with an element.
enum class Mark : signed char { kCoarsen = -1, kKeep = 0, kRefine = 1 };

struct MarkingOptions {
  double tolerance = 0;  ///< epsilon, in the unit of the indicator (Alg. 7, 8: of its sum), > 0
  double gamma_refine = 0.7;   ///< thesis 5.1
  double gamma_coarsen = 0.3;  ///< thesis 5.1
};

/// Alg. 6. If the largest indicator exceeds the tolerance, elements above gamma_refine times that
/// largest one or above the tolerance are to be refined. Those below gamma_coarsen times the
/// tolerance may be coarsened: the printed bound, gamma_C times the largest indicator, would also
/// coarsen what is above the tolerance and has to be refined again, and would leave a shape of
/// equal indicators as fine as it is.
std::vector<Mark> mark_geometry(const Eigen::VectorXd& eta, const MarkingOptions& options);

/// Alg. 7. If the indicators add up to more than the tolerance, elements with more than their share
/// |T| / |U| of it are to be refined. Those with less than gamma_coarsen of their share may be
/// coarsened, of which the print says nothing.
std::vector<Mark> mark_integral(const Eigen::VectorXd& eta, const Eigen::VectorXd& measures,
                                const MarkingOptions& options);

/// Alg. 8, of squares of interpolation errors. If the indicators add up to more than the tolerance,
/// elements above gamma_refine times the largest indicator are to be refined; coarsening as for
/// integrals.
std::vector<Mark> mark_function(const Eigen::VectorXd& eta, const Eigen::VectorXd& measures,
                                const MarkingOptions& options);

/// The rule of 4.2 for several indicators: refine if any says so, coarsen if all do.
void combine(std::vector<Mark>& marks, const std::vector<Mark>& others);

}  // namespace surf::fem
