#include "libsurf/segment/edges_along.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "libsurf/fem/geometry.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr Eigen::Index kMostProfiles = 400;
constexpr double kFirstSigma = 0.4;  // cells
constexpr int kMostScales = 5;
constexpr double kClear = 6;
constexpr int kRays = 24;
constexpr double kPronounced = 5;        // times the median slope of a ray
constexpr double kFirstSeedSigma = 0.7;  // cells
constexpr double kLeastBlur = 0.3, kMostBlur = 8, kUnknownBlur = 0.5;  // cells
constexpr double kFlatQuartile = 0.32;  // lower quartile of |N(0, 1)|
constexpr double kPlace = 0.1;
constexpr double kLeastMostSigma = 0.8;  // cells
// Of the image's range, and of its values, per cell: phantoms have no noise.
constexpr double kRounding = 1e-6, kRoundingOfValues = 1e-9;

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <int Dim>
double rounding(const ImageExtent<Dim>& extent) {
  const double lowest = extent.range[0], highest = extent.range[1];
  return std::max(kRounding * (highest - lowest),
                  kRoundingOfValues * std::max(std::abs(lowest), std::abs(highest))) /
         extent.cell_mm();
}

/// Slopes along lines, (lines, places) at every half cell, at any smoothing.
template <int Dim>
class Profiles {
 public:
  /// @param first, last  places along each line, in steps from its origin
  Profiles(Fields<Dim>& fields, const Options<Dim>& options, Points<Dim> origins,
           Points<Dim> directions, int first, int last)
      : fields_(fields),
        options_(options),
        step_mm_(fields.setting().extent().cell_mm() / 2),
        first_(first),
        last_(last),
        least_(rounding(fields.setting().extent())),
        origins_(std::move(origins)),
        directions_(std::move(directions)) {}
  virtual ~Profiles() = default;

  /// Slopes below are rounding [intensity/mm], >= 0.
  double least() const { return least_; }
  bool is_constant(double sigma_mm) { return at(sigma_mm).cwiseAbs().maxCoeff() <= least_; }
  /// The median slope, along its sign at the wider smoothing, at the edges that are seen there.
  double slope(double sigma_mm) {
    const Eigen::MatrixXd &narrow = at(sigma_mm), &wide = at(2 * sigma_mm);
    std::vector<double> out;
    for (Eigen::Index i = 0; i < wide.rows(); ++i) {
      const Eigen::Index place = edge(wide.row(i));
      out.push_back(wide(i, place) > 0 ? narrow(i, place) : -narrow(i, place));
    }
    return std::max(quantile(std::move(out), 0.5), 0.0);
  }
  /// The lower quartile of the amounts of the slopes beside the edges.
  double flat(double sigma_mm) {
    const Eigen::MatrixXd &narrow = at(sigma_mm), &wide = at(2 * sigma_mm);
    std::vector<double> all;
    for (Eigen::Index i = 0; i < wide.rows(); ++i)
      for (Eigen::Index s = 0; s < end_of_flat(wide.row(i)); ++s)
        all.push_back(std::abs(narrow(i, s)));
    return all.empty() ? 0 : quantile(std::move(all), 0.25);
  }

 protected:
  virtual Eigen::Index edge(const Eigen::RowVectorXd& slopes) const = 0;
  /// Places before this one tell what there is but the edge.
  virtual Eigen::Index end_of_flat(const Eigen::RowVectorXd& slopes) const { return slopes.size(); }

 private:
  const Eigen::MatrixXd& at(double sigma_mm) {
    const auto [known, is_new] = slopes_.try_emplace(sigma_mm);
    if (!is_new) return known->second;
    const auto I = fields_.model(field_options(options_, sigma_mm))->intensity();
    Eigen::MatrixXd& out = known->second;
    out.resize(origins_.rows(), last_ - first_ + 1);
    Samples<Dim> samples;
    for (int s = first_; s <= last_; ++s) {
      I->sample(origins_ + s * step_mm_ * directions_, Derivatives::kFirst, samples);
      out.col(s - first_) = (samples.gradient.array() * directions_.array()).rowwise().sum();
    }
    return out;
  }

  Fields<Dim>& fields_;
  const Options<Dim>& options_;
  double step_mm_;
  int first_, last_;
  double least_;
  Points<Dim> origins_, directions_;
  std::map<double, Eigen::MatrixXd> slopes_;
};

/// Along the normals of a shape: the edge is the steepest place within the reach.
template <int Dim>
class NormalProfiles : public Profiles<Dim> {
 public:
  NormalProfiles(Fields<Dim>& fields, const Options<Dim>& options, const Points<Dim>& places,
                 const Points<Dim>& normals, int reach)
      : Profiles<Dim>(fields, options, places, normals, -2 * reach, 2 * reach), reach_(reach) {}

 protected:
  Eigen::Index edge(const Eigen::RowVectorXd& slopes) const override {
    Eigen::Index place = 0;
    slopes.segment(reach_, 2 * reach_ + 1).cwiseAbs().maxCoeff(&place);
    return place + reach_;
  }

 private:
  int reach_;
};

/// Along rays: the edge is the first pronounced peak.
template <int Dim>
class RayProfiles : public Profiles<Dim> {
 public:
  using Profiles<Dim>::Profiles;

 protected:
  Eigen::Index edge(const Eigen::RowVectorXd& slopes) const override {
    const Eigen::RowVectorXd amounts = slopes.cwiseAbs();
    std::vector<double> all(amounts.begin(), amounts.end());
    const double least = std::max(kPronounced * quantile(std::move(all), 0.5), this->least());
    Eigen::Index highest = 0;
    for (Eigen::Index s = 0; s < amounts.size(); ++s) {
      if (amounts[highest] > least && amounts[s] < amounts[highest] / 2) return highest;
      if (amounts[s] > amounts[highest]) highest = s;
    }
    return highest;
  }
  /// What lies beyond is another object, or no image any more.
  Eigen::Index end_of_flat(const Eigen::RowVectorXd& slopes) const override {
    return edge(slopes) + 1;
  }
};

/// Blur, smoothing, slope and noise of what the profiles show.
/// @param first_sigma_mm  the least smoothing
template <int Dim>
EdgesAlong edges_of(Profiles<Dim>& profiles, const ImageExtent<Dim>& extent, double first_sigma_mm,
                    std::optional<double> given_sigma_mm) {
  const double cell = extent.cell_mm();
  const auto variance = [&](double sigma) { return std::pow(blur_mm(sigma, cell), 2); };
  EdgesAlong out;
  out.blur_mm = kUnknownBlur * cell;
  double sigma = first_sigma_mm;
  for (int scale = 0; scale < kMostScales; ++scale, sigma *= 2) {
    const double g = profiles.slope(sigma);
    if (profiles.is_constant(sigma)) break;  // nor is there an edge at wider ones
    if (!(g > kClear * profiles.flat(sigma))) continue;
    const double rho = std::pow(g / std::max(profiles.slope(2 * sigma), 1e-300), 2);
    if (!(rho > 1)) continue;  // blurred further an edge is flatter: this is noise
    const double square = (variance(2 * sigma) - rho * variance(sigma)) / (rho - 1);
    out.blur_mm = std::clamp(std::sqrt(std::max(square, 0.0)), kLeastBlur * cell, kMostBlur * cell);
    break;
  }
  const double most_sigma = std::max(out.blur_mm, kLeastMostSigma * cell);
  const double least = std::max(profiles.least() * cell, 1e-300);
  for (sigma = given_sigma_mm.value_or(first_sigma_mm);; sigma *= 2) {
    out.sigma_mm = sigma;
    out.slope = std::max(profiles.slope(sigma), least / cell);
    // Of white noise that is blurred by b: its slopes have 1 / (sqrt(2) b) times its deviation.
    out.noise = std::max(
        std::sqrt(2.0) * blur_mm(sigma, cell) * profiles.flat(sigma) / kFlatQuartile, least);
    const double whole_blur = std::hypot(blur_mm(sigma, cell), out.blur_mm);
    if (given_sigma_mm || out.noise <= kPlace * whole_blur * out.slope || 2 * sigma > most_sigma)
      return out;
  }
}

}  // namespace

template <int Dim>
EdgesAlong edges_along(Fields<Dim>& fields, const Options<Dim>& options,
                       const Simplices<Dim>& shape, double reach_mm) {
  const ImageExtent<Dim>& extent = fields.setting().extent();
  const Points<Dim> all = fem::Geometry<Dim>(shape.points, shape.elements).nodal_normals();
  const Eigen::Index stride = 1 + shape.points.rows() / kMostProfiles;
  const Eigen::Index n = (shape.points.rows() + stride - 1) / stride;
  Points<Dim> places(n, Dim), normals(n, Dim);
  for (Eigen::Index i = 0; i < n; ++i) {
    places.row(i) = shape.points.row(i * stride);
    normals.row(i) = all.row(i * stride).normalized();
  }
  const int reach = std::max(2, int(std::ceil(2 * reach_mm / extent.cell_mm())));
  NormalProfiles<Dim> profiles(fields, options, places, normals, reach);
  return edges_of<Dim>(profiles, extent, kFirstSigma * extent.cell_mm(), options.sigma_mm);
}

template <int Dim>
EdgesAlong edges_round(Fields<Dim>& fields, const Options<Dim>& options,
                       const std::vector<Vector<Dim>>& seeds) {
  const ImageExtent<Dim>& extent = fields.setting().extent();
  const Points<Dim> rays = directions_in<Dim>(extent, kRays);
  const std::vector<Vector<Dim>> centers = cell_centers<Dim>(extent, seeds);
  Points<Dim> origins(Eigen::Index(centers.size()) * rays.rows(), Dim), along(origins.rows(), Dim);
  for (std::size_t n = 0; n < centers.size(); ++n) {
    const Eigen::Index first = Eigen::Index(n) * rays.rows();
    origins.middleRows(first, rays.rows()).rowwise() = centers[n].transpose();
    along.middleRows(first, rays.rows()) = rays;
  }
  const int longest = *std::max_element(extent.size.begin(), extent.size.end());
  RayProfiles<Dim> profiles(fields, options, origins, along, 0, 2 * longest);
  return edges_of<Dim>(profiles, extent, kFirstSeedSigma * extent.cell_mm(), options.sigma_mm);
}

template EdgesAlong edges_round<2>(Fields<2>&, const Options<2>&, const std::vector<Vector<2>>&);
template EdgesAlong edges_round<3>(Fields<3>&, const Options<3>&, const std::vector<Vector<3>>&);
template EdgesAlong edges_along<2>(Fields<2>&, const Options<2>&, const Segments&, double);
template EdgesAlong edges_along<3>(Fields<3>&, const Options<3>&, const Triangles&, double);

}  // namespace surf::segment
