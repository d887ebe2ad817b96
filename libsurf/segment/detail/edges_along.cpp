#include "libsurf/segment/detail/edges_along.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "libsurf/fem/geometry.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

// Few of them depend on the order of vertices: over the 48 permutations and flips of a scan the
// volume spread by 0.8 % with 400.
constexpr Eigen::Index kMostProfiles = 4000;
constexpr Eigen::Index kMostPlaces = 1 << 17;  // that are sampled at once
constexpr double kFirstSigma = 0.4;            // cells
constexpr int kMostScales = 5;
constexpr double kShareOfThickness =
    0.5;                      // of the wider smoothing; a ball is as thick as its radius
constexpr double kClear = 3;  // deviations of the noise's slopes
// How much of the flattening may be noise: where less is the blur is certain, where more is no
// scale tells it.
constexpr double kCertain = 0.2, kUncertain = 1;
// Where the edge is looked for, by the smoothing of the wider slope: what rays meet depends on how
// far the image reaches, but not where it is seen under more smoothing.
constexpr double kOfNormals = 1, kOfRays = 2;
constexpr int kRays = 24;
constexpr double kPronounced = 5;        // times the median slope of a ray
constexpr double kFirstSeedSigma = 0.7;  // cells
constexpr double kLeastBlur = 0.3, kMostBlur = 8, kUnknownBlur = 0.5;  // cells
constexpr double kFlatQuartile = 0.32;  // lower quartile of |N(0, 1)|
constexpr double kBeside = 2.5;         // deviations of the whole blur: a step's slope is 4 % there
// Of the whole blur: how far noise may move an edge. Along wide edges more smoothing costs nothing;
// the bound for them was chosen on noisy balls of 256^3 and 512^3 voxels.
constexpr double kPlace = 0.1, kPlaceOfWide = 0.03;
// Of edges that are no wider all that lies near them counts as noise: twelve structures of eight
// scans have a mean Dice of 0.758 so, 0.753 without what is beside the edge.
constexpr double kWide = 2;              // cells
constexpr double kLeastMostSigma = 0.8;  // cells
// Deviations of the noise's slopes that those of wide edges round a seed have: then a quarter of
// them is more than three medians of |grad| of the noise, see estimate_edge_strength().
constexpr double kQuiet = 18;
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
  return std::max(kRounding * extent.width(),
                  kRoundingOfValues * std::max(std::abs(lowest), std::abs(highest))) /
         extent.cell_mm();
}

/// Deviation of the difference of the slopes of white noise under two blurs, in units of that
/// under the narrower one.
template <int Dim>
double noise_of_difference(double narrow, double wide) {
  const auto covariance = [&](double square) {
    return std::pow(narrow * narrow / square, (Dim + 2) / 2.0);
  };
  return std::sqrt(1 + covariance(wide * wide) -
                   2 * covariance((narrow * narrow + wide * wide) / 2));
}

/// From a point in the image to its nearest face.
template <int Dim>
double to_border_mm(const ImageExtent<Dim>& extent, const Vector<Dim>& point) {
  const Vector<Dim> index = extent.index_to_world.inverse() * point;
  double out = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < Dim; ++axis)
    out = std::min(out, std::min(index[axis] + 0.5, extent.size[axis] - 0.5 - index[axis]) *
                            extent.index_to_world.linear().col(axis).norm());
  return std::max(out, 0.0);
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
  /// The median slope, along its sign at a wider smoothing, at the edges that are seen there.
  double slope(double sigma_mm, double wider_mm) {
    const Eigen::MatrixXd &narrow = at(sigma_mm), &wide = at(wider_mm);
    std::vector<double> out;
    for (Eigen::Index i = 0; i < wide.rows(); ++i) {
      const Eigen::Index place = edge(wide.row(i));
      out.push_back(wide(i, place) > 0 ? narrow(i, place) : -narrow(i, place));
    }
    return std::max(quantile(std::move(out), 0.5), 0.0);
  }
  /// From the origins to the edges that are seen at this smoothing. [mm]
  double nearest_mm(double sigma_mm) {
    const Eigen::MatrixXd& slopes = at(sigma_mm);
    Eigen::Index out = slopes.cols();
    for (Eigen::Index i = 0; i < slopes.rows(); ++i) out = std::min(out, edge(slopes.row(i)));
    return double(first_ + out) * step_mm_;
  }
  /// Deviation of the slopes further than this from the edges, by the lower quartile of their
  /// amounts; of all where nothing is.
  double flat(double sigma_mm, double beside_mm) {
    const Eigen::MatrixXd& slopes = at(sigma_mm);
    const std::vector<double> beside =
        amounts(slopes, at(2 * sigma_mm), Eigen::Index(std::ceil(beside_mm / step_mm_)));
    return deviation(beside.empty() ? amounts(slopes, at(2 * sigma_mm), 0) : beside);
  }
  /// Deviation of the noise in the slopes: that of all, or what that of their differences to those
  /// at the wider smoothing says if it is less, as it is along edges that are wide in comparison.
  double noise(double sigma_mm) {
    const Eigen::MatrixXd &narrow = at(sigma_mm), &wide = at(2 * sigma_mm);
    const double cell = 2 * step_mm_;
    const double of_differences =
        deviation(amounts(narrow - wide, wide, 0)) /
        noise_of_difference<Dim>(blur_mm(sigma_mm, cell), blur_mm(2 * sigma_mm, cell));
    return std::min(of_differences, flat(sigma_mm, 0));
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
    // Line by line: at once at one place of all lines, threads make the same tiles.
    const Eigen::Index n_places = out.cols(), n_lines = 1 + kMostPlaces / n_places;
    const Eigen::VectorXd along =
        step_mm_ * Eigen::VectorXd::LinSpaced(n_places, double(first_), double(last_));
    Points<Dim> places;
    for (Eigen::Index line = 0; line < out.rows(); line += n_lines) {
      const Eigen::Index n = std::min(n_lines, out.rows() - line);
      places.resize(n * n_places, Dim);
      for (Eigen::Index i = 0; i < n; ++i)
        places.middleRows(i * n_places, n_places) =
            (along * directions_.row(line + i)).rowwise() + origins_.row(line + i);
      I->sample(places, Derivatives::kFirst, samples);
      for (Eigen::Index i = 0; i < n; ++i)
        out.row(line + i) = samples.gradient.middleRows(i * n_places, n_places) *
                            directions_.row(line + i).transpose();
    }
    return out;
  }
  /// Of values at the places that are at least so many from the edges of `wide`.
  std::vector<double> amounts(const Eigen::MatrixXd& values, const Eigen::MatrixXd& wide,
                              Eigen::Index beside) const {
    std::vector<double> out;
    for (Eigen::Index i = 0; i < wide.rows(); ++i) {
      const Eigen::Index place = edge(wide.row(i)), end = end_of_flat(wide.row(i));
      for (Eigen::Index s = 0; s < end; ++s)
        if (std::abs(s - place) >= beside) out.push_back(std::abs(values(i, s)));
    }
    return out;
  }
  static double deviation(std::vector<double> amounts) {
    return amounts.empty() ? 0 : quantile(std::move(amounts), 0.25) / kFlatQuartile;
  }

  Fields<Dim>& fields_;
  const Options<Dim>& options_;
  double step_mm_;
  int first_, last_;
  double least_;
  Points<Dim> origins_, directions_;
  std::map<double, Eigen::MatrixXd> slopes_;
};

/// Along the normals of a shape, `length` half cells to either side: the edge is the steepest
/// place within the reach.
template <int Dim>
class NormalProfiles : public Profiles<Dim> {
 public:
  NormalProfiles(Fields<Dim>& fields, const Options<Dim>& options, const Points<Dim>& places,
                 const Points<Dim>& normals, int reach, int length)
      : Profiles<Dim>(fields, options, places, normals, -length, length),
        first_(length - reach),
        n_(2 * reach + 1) {}

 protected:
  Eigen::Index edge(const Eigen::RowVectorXd& slopes) const override {
    Eigen::Index place = 0;
    slopes.segment(first_, n_).cwiseAbs().maxCoeff(&place);
    return place + first_;
  }

 private:
  int first_, n_;
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

/// s as the least scale tells it at which noise does not blur the answer, else the one at which it
/// does so least. [mm]
/// @param first_sigma_mm  the least smoothing
/// @param wider  of the smoothing under which edges are looked for to that of the wider slope
/// @param most_sigma_mm  under more smoothing the far sides flatten an edge too
template <int Dim>
double blur_of(Profiles<Dim>& profiles, const ImageExtent<Dim>& extent, double first_sigma_mm,
               double wider, double most_sigma_mm = std::numeric_limits<double>::infinity()) {
  const double cell = extent.cell_mm();
  const auto variance = [&](double sigma) { return std::pow(blur_mm(sigma, cell), 2); };
  double out = kUnknownBlur * cell, least_doubt = kUncertain, sigma = first_sigma_mm;
  double noise = std::numeric_limits<double>::infinity();
  for (int scale = 0; scale < kMostScales && least_doubt > kCertain; ++scale, sigma *= 2) {
    if (scale > 0 && 2 * sigma > most_sigma_mm) break;
    if (profiles.is_constant(sigma)) break;  // nor is there an edge at wider ones
    const double g = profiles.slope(sigma, 2 * sigma);
    noise = std::min(noise, profiles.noise(sigma));  // more blur leaves no more of it
    if (!(g > kClear * noise)) continue;
    const double rho =
        std::pow(g / std::max(profiles.slope(2 * sigma, wider * 2 * sigma), 1e-300), 2);
    // Blurred further an edge is flatter, else it is noise; but not gone: then its blur is unknown.
    if (!(rho > 1) || !std::isfinite(rho)) continue;
    const double doubt = 2 * noise / g / (rho - 1);
    if (!(doubt < least_doubt)) continue;
    least_doubt = doubt;
    const double square = (variance(2 * sigma) - rho * variance(sigma)) / (rho - 1);
    out = std::clamp(std::sqrt(std::max(square, 0.0)), kLeastBlur * cell, kMostBlur * cell);
  }
  return out;
}

/// Smoothing, slope and noise of edges of a known blur.
/// @param quiet  of wide edges, how many deviations of the noise's slopes their own have at least
template <int Dim>
EdgesAlong edges_of(Profiles<Dim>& profiles, const ImageExtent<Dim>& extent, double edge_blur_mm,
                    double first_sigma_mm, std::optional<double> given_sigma_mm, double quiet) {
  const double cell = extent.cell_mm();
  EdgesAlong out;
  out.blur_mm = edge_blur_mm;
  const double most_sigma = std::max(out.blur_mm, kLeastMostSigma * cell);
  const double least = std::max(profiles.least() * cell, 1e-300);
  const bool is_wide = edge_blur_mm > kWide * cell;
  for (double sigma = given_sigma_mm.value_or(first_sigma_mm);; sigma *= 2) {
    const double blur = blur_mm(sigma, cell), whole_blur = std::hypot(blur, out.blur_mm);
    out.sigma_mm = sigma;
    out.slope = std::max(profiles.slope(sigma, 2 * sigma), least / cell);
    // Of white noise that is blurred by b: its slopes have 1 / (sqrt(2) b) times its deviation.
    out.noise = std::max(
        std::sqrt(2.0) * blur * profiles.flat(sigma, is_wide ? kBeside * whole_blur : 0), least);
    const double place = is_wide ? kPlaceOfWide : kPlace;
    const bool is_quiet = !is_wide || quiet * profiles.noise(sigma) <= out.slope;
    if (given_sigma_mm || 2 * sigma > most_sigma ||
        (is_quiet && out.noise <= place * whole_blur * out.slope))
      return out;
  }
}

/// The points that do not lie on the border of the image, beyond which nothing is known: half of
/// what is met across it is constant, so that noise and slopes would be too small. All if there are
/// no others.
template <int Dim>
std::vector<Eigen::Index> within(const ImageExtent<Dim>& extent, const Points<Dim>& points) {
  std::vector<Eigen::Index> out, all;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    all.push_back(i);
    if (extent.faces(points.row(i).transpose()) == 0) out.push_back(i);
  }
  return out.empty() ? all : out;
}

}  // namespace

template <int Dim>
EdgesAlong edges_along(Fields<Dim>& fields, const Options<Dim>& options,
                       const Simplices<Dim>& shape, double reach_mm) {
  const ImageExtent<Dim>& extent = fields.setting().extent();
  const fem::Geometry<Dim> geometry(shape.points, shape.elements);
  const Points<Dim>& all = geometry.nodal_normals();
  const double thickness_mm = Dim * std::abs(geometry.enclosed()) / geometry.measure();
  const std::vector<Eigen::Index> vertices = within<Dim>(extent, shape.points);
  const std::size_t stride = 1 + vertices.size() / kMostProfiles;
  const auto n = Eigen::Index((vertices.size() + stride - 1) / stride);
  Points<Dim> places(n, Dim), normals(n, Dim);
  for (Eigen::Index i = 0; i < n; ++i) {
    places.row(i) = shape.points.row(vertices[std::size_t(i) * stride]);
    normals.row(i) = all.row(vertices[std::size_t(i) * stride]).normalized();
  }
  const int reach = std::max(2, int(std::ceil(2 * reach_mm / extent.cell_mm())));
  const double cell = extent.cell_mm(), first = kFirstSigma * cell;
  NormalProfiles<Dim> profiles(fields, options, places, normals, reach, 2 * reach);
  const double blur =
      blur_of<Dim>(profiles, extent, first, kOfNormals, kShareOfThickness * thickness_mm);
  const int beside = int(std::ceil(2 * kBeside * std::hypot(blur, blur_mm(first, cell)) / cell));
  if (beside <= reach || blur <= kWide * cell)
    return edges_of<Dim>(profiles, extent, blur, first, options.sigma_mm, 0);
  NormalProfiles<Dim> longer(fields, options, places, normals, reach, reach + 2 * beside);
  return edges_of<Dim>(longer, extent, blur, first, options.sigma_mm, 0);
}

template <int Dim>
EdgesAlong edges_round(Fields<Dim>& fields, const Options<Dim>& options,
                       const std::vector<Vector<Dim>>& seeds) {
  const ImageExtent<Dim>& extent = fields.setting().extent();
  const Points<Dim> rays = directions_in<Dim>(extent, kRays);
  const std::vector<Vector<Dim>> centers = cell_centers<Dim>(extent, seeds);
  Points<Dim> origins(Eigen::Index(centers.size()) * rays.rows(), Dim), along(origins.rows(), Dim);
  Eigen::Index line = 0;
  for (const auto& ray : rays.rowwise())  // those side by side follow each other
    for (const Vector<Dim>& center : centers) {
      origins.row(line) = center.transpose();
      along.row(line++) = ray;
    }
  const int longest = *std::max_element(extent.size.begin(), extent.size.end());
  RayProfiles<Dim> profiles(fields, options, origins, along, 0, 2 * longest);
  const double first = kFirstSeedSigma * extent.cell_mm();
  EdgesAlong out;
  out.blur_mm = blur_of<Dim>(profiles, extent, first, kOfRays);
  if (options.sigma_mm)
    out.sigma_mm = *options.sigma_mm;
  else
    out = edges_of<Dim>(profiles, extent, out.blur_mm, first, {}, kQuiet);
  if (options.seed_radius_mm) return out;
  out.nearest_mm = profiles.nearest_mm(2 * out.sigma_mm);
  for (const Vector<Dim>& center : centers)
    out.nearest_mm = std::min(out.nearest_mm, to_border_mm(extent, center));
  return out;
}

template EdgesAlong edges_round<2>(Fields<2>&, const Options<2>&, const std::vector<Vector<2>>&);
template EdgesAlong edges_round<3>(Fields<3>&, const Options<3>&, const std::vector<Vector<3>>&);
template EdgesAlong edges_along<2>(Fields<2>&, const Options<2>&, const Segments&, double);
template EdgesAlong edges_along<3>(Fields<3>&, const Options<3>&, const Triangles&, double);

}  // namespace surf::segment
