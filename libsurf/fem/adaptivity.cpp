#include "libsurf/fem/adaptivity.h"

#include <fmt/format.h>

#include <algorithm>

namespace surf::fem {
namespace {

/// Undoing one bisection makes edges up to twice as long: an error of order 3 grows by 8, the
/// square of one of order 2 by 16.
constexpr double kGrowthOfQuadratureError = 8, kGrowthOfInterpolationError = 16;

template <int Dim>
Eigen::VectorXd longest_edges(const Geometry<Dim>& shape) {
  const Elements<Dim>& T = shape.elements();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(T.rows());
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < Dim; ++i)
      for (int j = i + 1; j < Dim; ++j)
        out[t] = std::max(
            out[t], (shape.points().row(T(t, j)) - shape.points().row(T(t, i))).squaredNorm());
  return out.cwiseSqrt();
}

}  // namespace

template <int Dim>
std::string AdaptivityOptions<Dim>::error() const {
  const auto message = [](const char* field, double value, const char* constraint) {
    return fmt::format("AdaptivityOptions::{} = {} violates {}", field, value, constraint);
  };
  if (!(geometry_tolerance_mm >= 0))
    return message("geometry_tolerance_mm", geometry_tolerance_mm, ">= 0");
  if (!(integral_tolerance >= 0)) return message("integral_tolerance", integral_tolerance, ">= 0");
  if (!(function_tolerance >= 0)) return message("function_tolerance", function_tolerance, ">= 0");
  if (!(gamma_refine > 0 && gamma_refine <= 1))
    return message("gamma_refine", gamma_refine, "in (0, 1]");
  if (!(gamma_coarsen >= 0 && gamma_coarsen < gamma_refine))
    return message("gamma_coarsen", gamma_coarsen, "in [0, gamma_refine)");
  if (!(min_length_mm >= 0)) return message("min_length_mm", min_length_mm, ">= 0");
  if (!(max_length_mm >= min_length_mm && max_length_mm > 0))
    return message("max_length_mm", max_length_mm, ">= min_length_mm and > 0");
  return {};
}

template <int Dim>
std::vector<Mark> adaptivity_marks(const Geometry<Dim>& shape,
                                   const AdaptivityOptions<Dim>& options) {
  std::vector<Mark> marks(shape.n_elements(),
                          options.gamma_coarsen > 0 ? Mark::kCoarsen : Mark::kKeep);
  const auto marking = [&](double tolerance, double growth) {
    return MarkingOptions{.tolerance = tolerance,
                          .gamma_refine = options.gamma_refine,
                          .gamma_coarsen = std::min(options.gamma_coarsen, 1 / growth)};
  };
  if (options.geometry_tolerance_mm > 0)
    combine(marks,
            mark_geometry(geometric_variation(shape), marking(options.geometry_tolerance_mm, 1)));
  if (options.integral_tolerance > 0)
    for (const auto& f : options.integrands)
      combine(marks, mark_integral(quadrature_error(shape, *f), shape.measures(),
                                   marking(options.integral_tolerance * shape.measure(),
                                           kGrowthOfQuadratureError)));
  if (options.function_tolerance > 0)
    for (const auto& f : options.functions)
      combine(marks, mark_function(interpolation_error(shape, *f), shape.measures(),
                                   marking(options.function_tolerance * shape.measure(),
                                           kGrowthOfInterpolationError)));
  const Eigen::VectorXd longest = longest_edges(shape);
  for (Eigen::Index t = 0; t < longest.size(); ++t) {
    if (longest[t] > options.max_length_mm) marks[t] = Mark::kRefine;
    if (longest[t] > options.max_length_mm / 2 && marks[t] == Mark::kCoarsen)
      marks[t] = Mark::kKeep;  // it may become twice as long
    if (longest[t] <= options.min_length_mm && marks[t] == Mark::kRefine) marks[t] = Mark::kKeep;
  }
  return marks;
}

template struct AdaptivityOptions<2>;
template struct AdaptivityOptions<3>;
template std::vector<Mark> adaptivity_marks(const Geometry<2>&, const AdaptivityOptions<2>&);
template std::vector<Mark> adaptivity_marks(const Geometry<3>&, const AdaptivityOptions<3>&);

}  // namespace surf::fem
