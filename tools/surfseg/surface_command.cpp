#include "tools/surfseg/surface_command.h"

#include <fmt/format.h>

#include "libsurf/base/error.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/write_volume.h"
#include "tools/surfseg/slice_picture.h"

namespace surfseg {

std::vector<Output> SurfaceFiles::outputs() const {
  return {{"-o", output}, {"--mask", mask}, {"--picture", picture}, {"--thumbnail", thumbnail}};
}

void SurfaceFiles::check() const {
  if (output.empty()) throw surf::UsageError("-o: an output file is missing, such as -o liver.stl");
  if (!surf::io::is_writable_surface(output))
    throw surf::UsageError(fmt::format("-o: {}: expected a name that ends in {}", output,
                                       surf::io::writable_surfaces()));
  check_volume_name("--mask", mask);
  check_picture("--picture", picture);
  check_picture("--thumbnail", thumbnail);
  which.check();
}

std::shared_ptr<const surf::segment::Setting<3>> SurfaceFiles::setting(
    const surf::volume::Volume& volume) {
  return surf::segment::make_setting(volume);
}

void SurfaceCommand::write(const surf::segment::Object<3>& object,
                           const surf::segment::Finished<3>& finished) const {
  ImageCommand::write(object, finished);
  const std::string &picture = files().picture, &thumbnail = files().thumbnail;
  if (has_object(picture))
    write_picture(object_path(picture, object.name), finished.shape, image(), object.clicks);
  if (has_object(thumbnail))
    write_picture(object_path(thumbnail, object.name), finished.shape, image(), object.clicks,
                  kThumbnailWidth);
}

void SurfaceCommand::write_together(const surf::Triangles& all,
                                    const std::vector<surf::segment::Click<3>>& clicks) const {
  if (!has_object(files().picture)) write_picture(files().picture, all, image(), clicks);
  if (!has_object(files().thumbnail))
    write_picture(files().thumbnail, all, image(), clicks, kThumbnailWidth);
}

void SurfaceCommand::write_labels(const std::vector<std::uint8_t>& labels,
                                  const std::vector<surf::volume::LabelName>& names) const {
  if (!files().mask.empty())
    surf::volume::write_label_map(files().mask, image().size(), image().index_to_world(), labels,
                                  names);
}

void SurfaceCommand::write_shape(const std::string& path, const surf::segment::Finished<3>& shape,
                                 const surf::segment::Colour& colour) const {
  surf::io::WriteOptions options = files().write_options();
  options.colour = colour;
  surf::segment::write(path, shape, std::move(options));
}

std::string SurfaceCommand::describe(const surf::segment::Measures<3>& measures) const {
  return fmt::format(
      "{} triangles, {:.5g} ml, {:.5g} cm^2, closed, manifold, no self-intersections, smallest "
      "angle {:.1f} deg",
      measures.n_elements, measures.content / 1000, measures.measure / 100, measures.min_angle_deg);
}

}  // namespace surfseg
