#include "libsurf/fem/adaptivity.h"

#include <algorithm>

#include "libsurf/base/option_checks.h"

namespace surf::fem {
namespace {

/// Undoing one bisection makes edges up to twice as long: an error of order 3 grows by 8.
constexpr double kGrowthOfQuadratureError = 8;

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

template <int Dim>
MarkingOptions marking(const AdaptivityOptions<Dim>& options, double tolerance, double growth) {
  return {.tolerance = tolerance,
          .gamma_refine = options.gamma_refine,
          .gamma_coarsen = std::min(options.gamma_coarsen, 1 / growth)};
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> corners(const Geometry<Dim>& shape, Eigen::Index t) {
  Eigen::Matrix<double, Dim, Dim> out;
  for (int i = 0; i < Dim; ++i) out.row(i) = shape.points().row(shape.elements()(t, i));
  return out;
}

}  // namespace

template <int Dim>
std::string AdaptivityOptions<Dim>::error() const {
  OptionChecks check("AdaptivityOptions");
  check.require(geometry_tolerance_mm >= 0, "geometry_tolerance_mm", geometry_tolerance_mm, ">= 0");
  check.require(integral_tolerance >= 0, "integral_tolerance", integral_tolerance, ">= 0");
  check.require(gamma_refine > 0 && gamma_refine <= 1, "gamma_refine", gamma_refine, "in (0, 1]");
  check.require(gamma_coarsen >= 0 && gamma_coarsen < gamma_refine, "gamma_coarsen", gamma_coarsen,
                "in [0, gamma_refine)");
  check.require(min_length_mm >= 0, "min_length_mm", min_length_mm, ">= 0");
  check.require(max_length_mm >= min_length_mm && max_length_mm > 0, "max_length_mm", max_length_mm,
                ">= min_length_mm and > 0");
  return check.error();
}

template <int Dim>
std::vector<Mark> adaptivity_marks(const Geometry<Dim>& shape,
                                   const AdaptivityOptions<Dim>& options) {
  Eigen::MatrixXd errors;
  if (options.integral_tolerance > 0) {
    errors.resize(shape.n_elements(), Eigen::Index(options.integrands.size()));
    for (Eigen::Index k = 0; k < errors.cols(); ++k)
      errors.col(k) = quadrature_error(shape, *options.integrands[std::size_t(k)]);
  }
  return adaptivity_marks(shape, options, errors);
}

template <int Dim>
std::vector<Mark> adaptivity_marks(const Geometry<Dim>& shape,
                                   const AdaptivityOptions<Dim>& options,
                                   const Eigen::MatrixXd& errors) {
  std::vector<Mark> marks(shape.n_elements(),
                          options.gamma_coarsen > 0 ? Mark::kCoarsen : Mark::kKeep);
  if (options.geometry_tolerance_mm > 0)
    combine(marks, mark_geometry(geometric_variation(shape),
                                 marking<Dim>(options, options.geometry_tolerance_mm, 1)));
  if (options.integral_tolerance > 0)
    for (const auto& of_integrand : errors.colwise())
      combine(marks,
              mark_integral(of_integrand, shape.measures(),
                            marking<Dim>(options, options.integral_tolerance * shape.measure(),
                                         kGrowthOfQuadratureError)));
  const Eigen::VectorXd longest = longest_edges(shape);
  for (Eigen::Index t = 0; t < longest.size(); ++t) {
    if (options.rests && options.rests(corners(shape, t))) {
      marks[t] = Mark::kKeep;
      continue;
    }
    double longest_allowed = options.max_length_mm;
    if (options.is_fine && longest[t] > options.min_length_mm / 2 &&
        options.is_fine(corners(shape, t)))
      longest_allowed = options.min_length_mm;
    if (longest[t] > longest_allowed) marks[t] = Mark::kRefine;
    if (longest[t] > longest_allowed / 2 && marks[t] == Mark::kCoarsen)
      marks[t] = Mark::kKeep;  // it may become twice as long
    if (longest[t] <= options.min_length_mm && marks[t] == Mark::kRefine) marks[t] = Mark::kKeep;
  }
  return marks;
}

template struct AdaptivityOptions<2>;
template struct AdaptivityOptions<3>;
template std::vector<Mark> adaptivity_marks(const Geometry<2>&, const AdaptivityOptions<2>&);
template std::vector<Mark> adaptivity_marks(const Geometry<2>&, const AdaptivityOptions<2>&,
                                            const Eigen::MatrixXd&);
template std::vector<Mark> adaptivity_marks(const Geometry<3>&, const AdaptivityOptions<3>&);
template std::vector<Mark> adaptivity_marks(const Geometry<3>&, const AdaptivityOptions<3>&,
                                            const Eigen::MatrixXd&);

}  // namespace surf::fem
