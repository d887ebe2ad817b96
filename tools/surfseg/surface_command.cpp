#include "tools/surfseg/surface_command.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <filesystem>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/form.h"
#include "libsurf/mesh/region_intensities.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/command_line.h"
#include "tools/common/objects.h"
#include "tools/common/option_group.h"
#include "tools/common/reference.h"
#include "tools/report/report.h"
#include "tools/surfseg/slice_picture.h"

namespace surfseg {

using nlohmann::ordered_json;

namespace {

void check_is_there(const std::string& reference) {
  if (!std::filesystem::exists(reference))
    throw surf::InputError(fmt::format("--reference: {}: there is no such file", reference));
}

}  // namespace

std::vector<Output> SurfaceFiles::outputs() const {
  return {{"-o", output},
          {"--mask", mask},
          {"--picture", picture},
          {"--thumbnail", thumbnail},
          {"--report", report}};
}

void SurfaceFiles::check() const {
  if (output.empty()) throw surf::UsageError("-o: an output file is missing, such as -o liver.stl");
  if (!surf::io::is_writable_surface(output))
    throw surf::UsageError(fmt::format("-o: {}: expected a name that ends in {}", output,
                                       surf::io::writable_surfaces()));
  check_label_map_name("--mask", mask);
  check_is_of_all("--mask", mask);
  check_picture("--picture", picture);
  check_picture("--thumbnail", thumbnail);
  if (!report.empty() && surf::extension(report) != ".html")
    throw surf::UsageError(fmt::format("--report: {}: expected a name that ends in .html", report));
  check_is_of_all("--report", report);
  if (reference_label && reference.empty())
    throw surf::UsageError("--reference-label: which --reference has it?");
  if (!reference.empty() && !has_object(reference)) check_is_there(reference);
  which.check();
}

void SurfaceFiles::check_reference(const std::vector<std::string>& objects) const {
  if (!has_object(reference)) {
    if (reference_label && objects.size() > 1)
      throw surf::UsageError(
          "--reference-label: several objects have the labels 1, 2, ... of one --reference; put "
          "{object} into its name for a file of each");
    return;
  }
  if (objects.empty())
    throw surf::UsageError(fmt::format("--reference: {}: there is no --object to name", reference));
  for (const std::string& object : objects) check_is_there(object_path(reference, object));
}

void add_report_options(CLI::App& command, SurfaceFiles& files, const std::string& group) {
  const OptionGroup options(command, group);
  options.add("--report", files.report,
              "Page for people: verdict, pictures, the surface to be turned, measures, how it was "
              "made: .html");
  options.add("--reference", files.reference,
              "Mesh or label map that report and summary compare the surface with; several objects "
              "with the labels 1, 2, ... or {object}");
  options.add("--reference-label", files.reference_label, "Label of it [all that are not 0]");
}

surf::volume::Volume SurfaceFiles::read(const std::string& path,
                                        const std::string& series_uid) const {
  surf::volume::Volume scan = which.or_series(series_uid).read(path);
  surf::volume::check_dicom_output(output, scan);
  surf::volume::check_dicom_output(mask, scan);
  return scan;
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

surf::ImageBox<3> SurfaceCommand::image_box() const {
  return {image().size(), image().index_to_world(), image().world_to_index()};
}

void SurfaceCommand::write_labels(const std::vector<std::uint8_t>& labels,
                                  const std::vector<surf::volume::LabelName>& names) const {
  surf::volume::write_label_map(files().mask, image(), labels, names);
}

void SurfaceCommand::write_shape(const std::string& path, const surf::segment::Finished<3>& shape,
                                 const surf::segment::Object<3>& object) const {
  surf::io::WriteOptions options = files().write_options();
  options.colour = object.colour;
  options.name = object.name;
  options.dicom = image().dicom();
  surf::segment::write(path, shape, std::move(options));
}

void SurfaceCommand::measure(const surf::segment::Object<3>& object,
                             const surf::segment::Finished<3>& finished, int label,
                             ordered_json& entry) {
  entry["form"] = report::form_json(surf::mesh::form(finished.shape));
  if (!files().report.empty())
    entry["intensities"] =
        report::intensities_json(surf::mesh::region_intensities(finished.shape, image()));
  if (files().reference.empty()) return;
  const std::string path = object_path(files().reference, object.name);
  const bool is_one_label =
      label == 0 || has_object(files().reference) || surf::io::is_readable_surface(path);
  const std::optional<int> of = is_one_label ? files().reference_label : label;
  try {
    entry["reference"] = {{"file", path}, {"label", of ? ordered_json(*of) : ordered_json()}};
    entry["reference"].update(surface_scores(
        finished.shape, read_reference(path, of, VolumeArguments(), files().output_space), of));
  } catch (const surf::Error& error) {  // the surface is none the worse for it
    entry["reference"]["not_compared"] = error.what();
    progress().note(fmt::format("note: --reference: {}", error.what()));
  }
}

void SurfaceCommand::write_report(ExitCode exit_code,
                                  const std::vector<ReportedObject<3>>& objects) const {
  if (files().report.empty()) return;
  surf::write_bytes(
      files().report,
      report::page({command_line("surfseg", command(),
                                 {"threads", "quiet", "verbose", "progress", "profile", "json",
                                  "checkpoint", "resume", "memory"}),
                    int(exit_code), image(), Files::setting(image())->content_hash(), objects}));
}

std::string SurfaceCommand::describe(const surf::segment::Measures<3>& measures) const {
  return fmt::format(
      "{} triangles, {:.5g} ml, {:.5g} cm^2, closed, manifold, no self-intersections, smallest "
      "angle {:.1f} deg",
      measures.n_elements, measures.content / 1000, measures.measure / 100, measures.min_angle_deg);
}

}  // namespace surfseg
