#include "libcurve/segment/segment.h"

#include "libcurve/segment/detail/curve_setting.h"
#include "libcurve/segment/detail/image_model.h"
#include "libsurf/base/error.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::curve {

std::shared_ptr<const segment::Setting<2>> make_setting(const Image& image) {
  return std::make_shared<const CurveSetting>(image);
}

Image denoised(const Image& image, const CurveOptions& options, const CurveResult& result) {
  const auto parameters = segment::piecewise_smooth<2>(result.energies);
  if (!parameters)
    throw UsageError(
        "a denoised image belongs to Options::energies mumford-shah, which is not used");
  const auto energy = mumford_shah(
      image, intensity_field(image, segment::field_options<2>(options, result.sigma_mm)),
      *parameters);
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

}  // namespace surf::curve
