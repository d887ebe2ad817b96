#include "libcurve/segment/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/mesh/from_level.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/moving_curve.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/segment/detail/curve_setting.h"
#include "libsurf/base/error.h"
#include "libsurf/segment/contrast.h"

namespace surf::curve {
namespace {

using segment::EnergyModel;
using segment::GrowingShape;
using segment::ImageExtent;
using segment::ShapeOptions;

/// The pixels' squares, out to half a pixel beyond the outermost centres, where curves may run.
Points<2> pixel_box(const Image& image) {
  const double right = image.size()[0] - 0.5, bottom = image.size()[1] - 0.5;
  Eigen::Matrix<double, 2, 4> corners;
  corners << -0.5, right, right, -0.5, -0.5, -0.5, bottom, bottom;
  if (image.pixel_to_plane().linear().determinant() < 0) corners.col(1).swap(corners.col(3));
  return (image.pixel_to_plane() * corners).transpose();
}

std::unique_ptr<MumfordShah> mumford_shah(const Image& image,
                                          std::shared_ptr<const Field<2>> intensity,
                                          const segment::EnergyTerm& term) {
  MumfordShahOptions options;
  options.mu = segment::parameter(term, "mu");
  options.gamma = segment::parameter(term, "gamma");
  options.contrast = segment::parameter(term, "contrast");
  if (term.parameters.contains("data-tolerance"))
    options.data_tolerance = segment::parameter(term, "data-tolerance");
  options.outer = pixel_box(image);
  options.pixel_mm = image.pixel_size();
  return std::make_unique<MumfordShah>(std::move(intensity), options);
}

class ImageModel : public EnergyModel<2> {
 public:
  ImageModel(const Image& image, const ImageExtent<2>& extent, const FieldOptions& options)
      : EnergyModel<2>(extent),
        image_(image),
        options_(options),
        intensity_(intensity_field(image, options)) {}

  std::shared_ptr<const Field<2>> intensity() const override { return intensity_; }
  double contrast() const override { return segment::two_class_contrast(image_.values()); }

 protected:
  std::shared_ptr<const Field<2>> make_edge_indicator(double lambda) const override {
    return curve::edge_indicator(image_, options_, lambda);
  }
  energy::ImageTotals totals() const override {
    double sum = 0, squares = 0;
    for (const float value : image_.values()) {
      sum += value;
      squares += double(value) * value;
    }
    const double pixel = image_.pixel_size() * image_.pixel_size();
    return {pixel * double(image_.n_pixels()), pixel * sum, pixel * squares};
  }
  std::unique_ptr<energy::ShapeEnergy<2>> make_mumford_shah(
      const segment::EnergyTerm& term) const override {
    return mumford_shah(image_, intensity_, term);
  }
  std::optional<energy::Antiderivative<2>> antiderivative() const override {
    if (options_.interpolation != Interpolation::kSpline) return {};
    return energy::Antiderivative<2>{image_.pixel_to_plane().linear().col(0),
                                     intensity_antiderivative(image_, options_)};
  }

 private:
  Image image_;
  FieldOptions options_;
  std::shared_ptr<const Field<2>> intensity_;
};

class GrowingCurve : public GrowingShape<2> {
 public:
  GrowingCurve(const Segments& start, const MovingCurveOptions& options) : curve_(start, options) {}

  flow::MovingShape<2>& moving() override { return curve_; }
  Segments simplices() const override { return curve_.segments(); }
  double border_share() const override { return curve_.border_share(); }
  bool is_limited() const override { return curve_.is_limited(); }
  void set_edge_length(double edge_length_mm) override { curve_.set_edge_length(edge_length_mm); }
  void set_integrands(std::vector<std::shared_ptr<const Field<2>>> integrands) override {
    curve_.set_integrands(std::move(integrands));
  }

 private:
  MovingCurve curve_;
};

void check_seeds(const Image& image, const std::vector<Vector<2>>& seeds) {
  for (const Vector<2>& seed : seeds) {
    const Vector<2> pixel = image.plane_to_pixel() * seed;
    if (!image.contains(seed))
      throw UsageError(fmt::format(
          "--seed: ({:g}, {:g}) mm is pixel ({:.1f}, {:.1f}), outside the image of {} x {} pixels; "
          "is it in another space (--space)?",
          seed[0], seed[1], pixel[0], pixel[1], image.size()[0], image.size()[1]));
  }
}

/// Whether a component winds round the point.
bool winds_round(const Segments& curves, const CurveHierarchy& hierarchy, int component,
                 const Vector<2>& point) {
  bool inside = false;
  for (Eigen::Index t = 0; t < curves.elements.rows(); ++t) {
    if (hierarchy.of_element[t] != component) continue;
    const Vector<2> a = curves.points.row(curves.elements(t, 0)),
                    b = curves.points.row(curves.elements(t, 1));
    if ((a[1] > point[1]) == (b[1] > point[1])) continue;
    if (a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > point[0]) inside = !inside;
  }
  return inside;
}

/// Regions that stay, by number.
std::vector<char> kept_regions(const Segments& curves, const CurveHierarchy& hierarchy,
                               const std::vector<Region>& all, const RegionFilter& filter) {
  std::vector<char> keep(all.size());
  for (std::size_t n = 0; n < all.size(); ++n) keep[n] = all[n].area_mm2 >= filter.min_area_mm2;
  if (filter.keep == mesh::Keep::kLargest && !all.empty()) {
    const auto largest = std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.area_mm2 < b.area_mm2;
    });
    for (std::size_t n = 0; n < all.size(); ++n)
      keep[n] &= std::ptrdiff_t(n) == largest - all.begin();
  }
  if (filter.keep == mesh::Keep::kSeeded)
    for (std::size_t n = 0; n < all.size(); ++n)
      keep[n] &=
          std::any_of(filter.seeds_mm.begin(), filter.seeds_mm.end(), [&](const Vector<2>& seed) {
            const auto winds = [&](int c) { return winds_round(curves, hierarchy, c, seed); };
            return winds(all[n].outer) &&
                   std::none_of(all[n].holes.begin(), all[n].holes.end(), winds);
          });
  return keep;
}

Segments without_holes(const Segments& curves) {
  const CurveHierarchy hierarchy = curve_hierarchy(curves);
  std::vector<char> keep;
  for (const Component& component : hierarchy.components) keep.push_back(component.depth == 0);
  return kept(curves, hierarchy, keep);
}

RegionFilter region_filter(const CurveOptions& options) {
  RegionFilter filter = options.regions;
  filter.seeds_mm = options.seeds_mm;
  return filter;
}

}  // namespace

CurveSetting::CurveSetting(const Image& image, const FieldOptions& options)
    : image_(image),
      options_(options),
      extent_{image.size(), image.pixel_to_plane(), image.plane_to_pixel(), image.range()} {}

std::unique_ptr<EnergyModel<2>> CurveSetting::make_model(
    const volume::SmoothingOptions& smoothing) const {
  FieldOptions options = options_;
  options.smoothing = smoothing;
  return std::make_unique<ImageModel>(image_, extent_, options);
}

std::unique_ptr<GrowingShape<2>> CurveSetting::make_shape(const Segments& start,
                                                          const ShapeOptions<2>& options) const {
  auto curve = options.to<MovingCurveOptions>();
  curve.box = ImageBox{image_.plane_to_pixel(), image_.pixel_to_plane(), image_.size()};
  return std::make_unique<GrowingCurve>(start, curve);
}

Segments CurveSetting::ball(const Vector<2>& center, double radius, double edge_length) const {
  return circle(center, radius, edge_length);
}

Segments CurveSetting::joined(const std::vector<Segments>& parts) const {
  return curve::joined(parts);
}

Segments CurveSetting::flipped(const Segments& shape) const { return curve::flipped(shape); }

std::vector<std::uint8_t> CurveSetting::rasterized(const Segments& shape,
                                                   const std::array<int, 2>& size,
                                                   const Eigen::Affine2d& index_to_world) const {
  return rasterize(shape, size, index_to_world);
}

Segments CurveSetting::shape_of_level(std::span<const float> values, const std::array<int, 2>& size,
                                      const Eigen::Affine2d& index_to_world, double level) const {
  return curve_of_level(values, size, index_to_world, level);
}

bool CurveSetting::is_embedded(const Segments& shape) const {
  return intersections(shape.points, shape.elements).empty();
}

/// Nodes of elements that would intersect stay where they are, until none does.
Segments CurveSetting::moved(const Segments& shape, const Points<2>& to) const {
  Segments out{to, shape.elements};
  while (true) {
    const auto pairs = intersections(out.points, out.elements);
    bool has_changed = false;
    for (const auto& [a, b] : pairs)
      for (const int element : {a, b})
        for (const int node : {out.elements(element, 0), out.elements(element, 1)}) {
          has_changed |= out.points.row(node) != shape.points.row(node);
          out.points.row(node) = shape.points.row(node);
        }
    if (!has_changed) return out;
  }
}

std::string RegionFilter::error() const {
  if (!(min_area_mm2 >= 0))
    return fmt::format("RegionFilter::min_area_mm2 = {} violates >= 0", min_area_mm2);
  if (keep == mesh::Keep::kSeeded && seeds_mm.empty())
    return "RegionFilter::keep is kSeeded and there is no seed";
  return {};
}

Segments filtered(const Segments& curves, const RegionFilter& filter, int& n_removed) {
  if (const std::string error = filter.error(); !error.empty()) throw UsageError(error);
  const auto n_before = curve_hierarchy(curves).components.size();
  const Segments filled = filter.fill_holes ? without_holes(curves) : curves;
  const CurveHierarchy hierarchy = curve_hierarchy(filled);
  const std::vector<Region> all = regions(hierarchy);
  const std::vector<char> keep_region = kept_regions(filled, hierarchy, all, filter);
  std::vector<char> keep(hierarchy.components.size(), 0);
  for (std::size_t n = 0; n < all.size(); ++n) {
    if (!keep_region[n]) continue;
    keep[all[n].outer] = 1;
    for (const int hole : all[n].holes) keep[hole] = 1;
  }
  n_removed = int(n_before) - std::accumulate(keep.begin(), keep.end(), 0);
  return n_removed == 0 ? curves : kept(filled, hierarchy, keep);
}

std::string CurveOptions::error() const {
  if (std::string error = RunOptions<2>::error(); !error.empty()) return error;
  if (topology == mesh::Topology::kGenus0)
    return "CurveOptions::topology = genus0 has no meaning for curves";
  return region_filter(*this).error();
}

Image denoised(const Image& image, const CurveOptions& options, const CurveResult& result) {
  const auto term = std::find_if(result.energies.begin(), result.energies.end(),
                                 [](const auto& t) { return t.name == "mumford-shah"; });
  if (term == result.energies.end())
    throw UsageError("a denoised image belongs to --energy mumford-shah, which is not used");
  volume::SmoothingOptions smoothing;
  smoothing.sigma_mm = result.sigma_mm;
  smoothing.selective_sigma_mm = options.selective_sigma_mm;
  smoothing.selective_threshold = options.selective_threshold;
  const auto energy = mumford_shah(
      image, intensity_field(image, {smoothing, options.derivative_filter, options.interpolation}),
      *term);
  energy->reset({result.shape.points, result.shape.elements});
  Points<2> pixels(Eigen::Index(image.n_pixels()), 2);
  for (int j = 0; j < image.size()[1]; ++j)
    for (int i = 0; i < image.size()[0]; ++i)
      pixels.row(Eigen::Index(j) * image.size()[0] + i) = image.pixel_to_plane() * Vector<2>(i, j);
  const Eigen::VectorXf u = energy->denoised(pixels).cast<float>();
  return {image.size(),
          image.pixel_to_plane(),
          {u.begin(), u.end()},
          image.source(),
          image.plane_to_ras()};
}

CurveResult segment(const Image& image, const CurveOptions& options,
                    const CurveProgress& progress) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  segment::check_terms(options.energies);
  check_seeds(image, options.seeds_mm);
  const CurveSetting setting(
      image, {.filter = options.derivative_filter, .interpolation = options.interpolation});
  CurveResult result = segment::run<2>(setting, options, progress);
  int n_removed = 0;
  Segments rest = filtered(result.shape, region_filter(options), n_removed);
  if (n_removed > 0) {
    result.shape = std::move(rest);
    result.notes.push_back(fmt::format("removed: {} {} that the options rule out", n_removed,
                                       n_removed == 1 ? "curve" : "curves"));
  }
  return result;
}

}  // namespace surf::curve
