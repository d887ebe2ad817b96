#include "libsurf/segment/edges_along.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "libsurf/fem/geometry.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr Eigen::Index kMostProfiles = 400;
constexpr double kFirstSigma = 0.4;                                    // cells
constexpr int kMostScales = 5;
constexpr double kClear = 6;
constexpr double kLeastBlur = 0.3, kMostBlur = 8, kUnknownBlur = 0.5;  // cells
constexpr double kFlatQuartile = 0.32;  // lower quartile of |N(0, 1)|
constexpr double kPlace = 0.1;
constexpr double kLeastMostSigma = 0.8;  // cells

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Slopes d_nu I on both sides of a shape, (profiles, places), at any smoothing.
template <int Dim>
class Profiles {
 public:
  Profiles(Fields<Dim>& fields, const Options<Dim>& options, const Simplices<Dim>& shape,
           double reach_mm)
      : fields_(fields),
        options_(options),
        step_mm_(fields.setting().extent().cell_mm() / 2),
        reach_(std::max(2, int(std::ceil(reach_mm / step_mm_)))) {
    const Points<Dim> all = fem::Geometry<Dim>(shape.points, shape.elements).nodal_normals();
    const Eigen::Index stride = 1 + shape.points.rows() / kMostProfiles;
    const Eigen::Index n = (shape.points.rows() + stride - 1) / stride;
    places_.resize(n, Dim);
    normals_.resize(n, Dim);
    for (Eigen::Index i = 0; i < n; ++i) {
      places_.row(i) = shape.points.row(i * stride);
      normals_.row(i) = all.row(i * stride).normalized();
    }
  }

  /// The median slope, along its sign at the wider smoothing, at the places that are steepest there.
  double slope(double sigma_mm) {
    const Eigen::MatrixXd &narrow = at(sigma_mm), &wide = at(2 * sigma_mm);
    std::vector<double> out;
    for (Eigen::Index i = 0; i < wide.rows(); ++i) {
      const Eigen::Index first = wide.cols() / 2 - reach_;
      Eigen::Index place = 0;
      wide.row(i).segment(first, 2 * reach_ + 1).cwiseAbs().maxCoeff(&place);
      place += first;
      out.push_back(wide(i, place) > 0 ? narrow(i, place) : -narrow(i, place));
    }
    return std::max(quantile(std::move(out), 0.5), 0.0);
  }
  /// The lower quartile of all slopes' amounts.
  double flat(double sigma_mm) {
    const Eigen::MatrixXd& values = at(sigma_mm);
    std::vector<double> all(values.data(), values.data() + values.size());
    for (double& value : all) value = std::abs(value);
    return quantile(std::move(all), 0.25);
  }

 private:
  const Eigen::MatrixXd& at(double sigma_mm) {
    const auto [known, is_new] = slopes_.try_emplace(sigma_mm);
    if (!is_new) return known->second;
    const auto I = fields_.model(field_options(options_, sigma_mm))->intensity();
    Eigen::MatrixXd& out = known->second;
    out.resize(places_.rows(), 4 * reach_ + 1);
    Samples<Dim> samples;
    for (int s = -2 * reach_; s <= 2 * reach_; ++s) {
      I->sample(places_ + s * step_mm_ * normals_, Derivatives::kFirst, samples);
      out.col(s + 2 * reach_) = (samples.gradient.array() * normals_.array()).rowwise().sum();
    }
    return out;
  }

  Fields<Dim>& fields_;
  const Options<Dim>& options_;
  double step_mm_;
  int reach_;  // steps
  Points<Dim> places_, normals_;
  std::map<double, Eigen::MatrixXd> slopes_;
};

}  // namespace

template <int Dim>
EdgesAlong edges_along(Fields<Dim>& fields, const Options<Dim>& options,
                       const Simplices<Dim>& shape, double reach_mm) {
  const double cell = fields.setting().extent().cell_mm();
  Profiles<Dim> profiles(fields, options, shape, reach_mm);
  const auto variance = [&](double sigma) { return std::pow(blur_mm(sigma, cell), 2); };
  EdgesAlong out;
  out.blur_mm = kUnknownBlur * cell;
  double sigma = kFirstSigma * cell;
  for (int scale = 0; scale < kMostScales; ++scale, sigma *= 2) {
    const double g = profiles.slope(sigma);
    if (!(g > kClear * profiles.flat(sigma))) continue;
    const double rho = std::pow(g / std::max(profiles.slope(2 * sigma), 1e-300), 2);
    const double square = rho > 1 ? (variance(2 * sigma) - rho * variance(sigma)) / (rho - 1)
                                  : std::pow(kMostBlur * cell, 2);
    out.blur_mm = std::clamp(std::sqrt(std::max(square, 0.0)), kLeastBlur * cell, kMostBlur * cell);
    break;
  }
  const double most_sigma = std::max(out.blur_mm, kLeastMostSigma * cell);
  const auto [lowest, highest] = fields.setting().extent().range;
  const double least = 1e-6 * std::max(double(highest) - lowest, 1e-300);  // phantoms have no noise
  for (sigma = options.sigma_mm.value_or(kFirstSigma * cell);; sigma *= 2) {
    out.sigma_mm = sigma;
    out.slope = std::max(profiles.slope(sigma), least / cell);
    // Of white noise that is blurred by b: its slopes have 1 / (sqrt(2) b) times its deviation.
    out.noise = std::max(
        std::sqrt(2.0) * blur_mm(sigma, cell) * profiles.flat(sigma) / kFlatQuartile, least);
    const double whole_blur = std::hypot(blur_mm(sigma, cell), out.blur_mm);
    if (options.sigma_mm || out.noise <= kPlace * whole_blur * out.slope || 2 * sigma > most_sigma)
      return out;
  }
}

template EdgesAlong edges_along<2>(Fields<2>&, const Options<2>&, const Segments&, double);
template EdgesAlong edges_along<3>(Fields<3>&, const Options<3>&, const Triangles&, double);

}  // namespace surf::segment
