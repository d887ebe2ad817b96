#include "libcurve/segment/detail/image_model.h"

#include "libsurf/segment/contrast.h"

namespace surf::curve {
namespace {

/// The pixels' squares, where curves may run, and half a pixel more.
Points<2> pixel_box(const Image& image) {
  const double right = image.size()[0], bottom = image.size()[1];
  Eigen::Matrix<double, 2, 4> corners;
  corners << -1, right, right, -1, -1, -1, bottom, bottom;
  if (image.pixel_to_plane().linear().determinant() < 0) corners.col(1).swap(corners.col(3));
  return (image.pixel_to_plane() * corners).transpose();
}

}  // namespace

std::unique_ptr<MumfordShah> mumford_shah(const Image& image,
                                          std::shared_ptr<const Field<2>> intensity,
                                          const segment::PiecewiseSmooth& parameters) {
  MumfordShahOptions options;
  options.mu = parameters.mu;
  options.gamma = parameters.gamma;
  options.contrast = parameters.contrast;
  options.data_tolerance = parameters.data_tolerance.value_or(options.data_tolerance);
  options.outer = pixel_box(image);
  options.pixel_mm = image.pixel_size();
  return std::make_unique<MumfordShah>(std::move(intensity), options);
}

ImageModel::ImageModel(const Image& image, const segment::ImageExtent<2>& extent,
                       const FieldOptions& options)
    : EnergyModel<2>(extent),
      image_(image),
      options_(options),
      intensity_(intensity_field(image, options)) {}

double ImageModel::contrast(const segment::SeedModel& seed) const {
  return segment::two_class_contrast(image_.values(), segment::with_object(extent().usual, seed));
}

std::size_t ImageModel::memory_bytes() const {
  return image_.n_pixels() * sizeof(float) * std::size_t(1 + n_edge_indicators_);
}

std::optional<energy::Antiderivative<2>> ImageModel::antiderivative() const {
  if (options_.interpolation != Interpolation::kSpline) return {};
  return energy::Antiderivative<2>{image_.pixel_to_plane().linear().col(0),
                                   intensity_antiderivative(image_, options_),
                                   image_.pixel_to_plane().linear().col(1).norm()};
}

std::unique_ptr<energy::ShapeEnergy<2>> ImageModel::mumford_shah(
    const segment::PiecewiseSmooth& parameters) const {
  return curve::mumford_shah(image_, intensity_, parameters);
}

std::shared_ptr<const Field<2>> ImageModel::make_edge_indicator(double lambda) const {
  ++n_edge_indicators_;
  return curve::edge_indicator(image_, options_, lambda);
}

energy::ImageTotals ImageModel::sum_up() const {
  double sum = 0, squares = 0;
  for (const float value : image_.values()) {
    sum += value;
    squares += double(value) * value;
  }
  const double pixel = image_.pixel_size() * image_.pixel_size();
  return {pixel * double(image_.n_pixels()), pixel * sum, pixel * squares};
}

}  // namespace surf::curve
