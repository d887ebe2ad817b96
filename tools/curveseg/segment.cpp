// curveseg segment: an image and seeds in, verified contours out.
#include "libcurve/segment/segment.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <filesystem>

#include "libcurve/image/read_image.h"
#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/energy_assembly.h"
#include "tools/common/option_group.h"
#include "tools/common/strokes.h"
#include "tools/common/verb.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/curve_command.h"
#include "tools/curveseg/curve_run.h"

namespace surfseg::curve_program {
namespace {

using surf::Segments;
using surf::curve::Image;

struct Arguments : CurveArguments, CurveFiles {
  std::string overlay, frames, denoised, start;
};

/// Pictures of the evolution, one for each step.
class Frames {
 public:
  Frames(const std::string& folder, const Image& image) : folder_(folder), image_(image) {}

  void add(const Segments& curves) {
    if (folder_.empty()) return;
    const auto name = fmt::format("frame-{:05}.png", n_++);
    surf::io::write_png((std::filesystem::path(folder_) / name).string(),
                        surf::curve::draw_overlay(image_, curves));
  }

 private:
  std::string folder_;
  const Image& image_;
  int n_ = 0;
};

class SegmentCurves : public CurveCommand {
 public:
  SegmentCurves(const CLI::App& command, const Arguments& arguments)
      : CurveCommand(command, arguments, arguments), arguments_(arguments) {}

 protected:
  void check() const override {
    arguments_.CurveFiles::check();
    check_picture("--picture", arguments_.overlay);
    if (!arguments_.denoised.empty() && !surf::curve::is_writable_image(arguments_.denoised))
      throw surf::UsageError(fmt::format(
          "--denoised: {}: expected a name that ends in .png or .tif", arguments_.denoised));
    if (!arguments_.start.empty() && !surf::curve::is_readable_contour(arguments_.start))
      throw surf::UsageError(
          fmt::format("--start: {}: expected a name that ends in .json or .csv", arguments_.start));
    check_curve_arguments(command(), arguments_);
    if (!arguments_.denoised.empty() &&
        !surf::segment::is_piecewise_smooth<2>(arguments_.terms(command())))
      throw surf::UsageError("--denoised: belongs to --energy mumford-shah, which is not used");
    arguments_.image.check();
    check_objects(command(), arguments_,
                  {{"-o", arguments_.output},
                   {"--denoised", arguments_.denoised},
                   {"--start", arguments_.start}});
    if (!arguments_.objects.empty() && arguments_.has_initial())
      throw surf::UsageError(
          "--object: each is looked for from its own --seed, not from an initial curve");
    const std::vector<Output> inputs =
        read_files(arguments_, {{"the input", arguments_.image.path},
                                {"--contour", arguments_.contour},
                                {"--landmarks", arguments_.landmarks}});
    std::vector<Output> outputs = candidate_outputs(arguments_, arguments_.output, inputs);
    outputs.insert(outputs.end(), {{"-o", arguments_.output},
                                   {"--mask", arguments_.mask},
                                   {"--picture", arguments_.overlay},
                                   {"--denoised", arguments_.denoised},
                                   {"--start", arguments_.start},
                                   {"--recipe", arguments_.recipe},
                                   {"--checkpoint", checkpoint_path()},
                                   {"--json", arguments_.json}});
    check_outputs(object_outputs(outputs, arguments_.objects), inputs);
    if (!arguments_.frames.empty() && !std::filesystem::is_directory(arguments_.frames))
      throw surf::OutputError(
          fmt::format("--frames: the folder {} does not exist", arguments_.frames));
  }

  Input read() override {
    auto setting = open(arguments_.image.path);
    frames_.emplace(arguments_.frames, image());
    return {std::move(setting),
            objects_of<2>(command(), arguments_, curve_options(command(), arguments_, image()),
                          boxes_mm(arguments_, image()), strokes())};
  }

  std::vector<std::string> idle_options() const override {
    return idle_curve_options(command(), arguments_);
  }

  void show(const std::function<Segments()>& curves) override {
    if (!arguments_.frames.empty()) frames_->add(curves());
  }

  void write(const surf::segment::Object<2>& object,
             const surf::segment::Finished<2>& finished) const override {
    CurveCommand::write(object, finished);
    const auto path = [&](const std::string& pattern) { return object_path(pattern, object.name); };
    if (has_object(arguments_.overlay))
      surf::io::write_png(path(arguments_.overlay),
                          surf::curve::draw_overlay(image(), finished.shape));
    if (!arguments_.denoised.empty())
      surf::curve::write_image(path(arguments_.denoised),
                               surf::curve::denoised(image(), object.options, *object.result));
    if (!arguments_.start.empty())
      surf::curve::write_contours(path(arguments_.start), object.result->start, image());
  }

  void write_together(const surf::Segments& all,
                      const std::vector<surf::segment::Click<2>>&) const override {
    if (!arguments_.overlay.empty() && !has_object(arguments_.overlay))
      surf::io::write_png(arguments_.overlay, surf::curve::draw_overlay(image(), all));
  }

 private:
  /// Of each label map: an image, or the same slice of a volume.
  std::vector<std::vector<surf::segment::Click<2>>> strokes() const {
    // Painted images have no place of their own: theirs is that of the image.
    const auto box = [&](const std::array<int, 2>& size) {
      return surf::ImageBox<2>{size, image().pixel_to_plane(), image().plane_to_pixel()};
    };
    const bool has_inside = !arguments_.seeds.empty() || arguments_.has_initial();
    return strokes_of<2>(
        arguments_.marks, box(image().size()), has_inside, [&](const std::string& path) {
          ImageArguments which = arguments_.image;
          which.path = path;
          which.are_labels = true;
          which.which.frame_index = 0;
          if (const std::string ending = surf::extension(path);
              ending != ".tif" && ending != ".tiff")
            which.page = 0;
          if (surf::curve::is_image_file(path)) which.slice = which.plane = "";
          if (!std::filesystem::is_directory(path)) which.which.series_uid = "";
          const Image marks = which.read();
          const auto from = place_of(marks), to = place_of(image());
          return Marks<2>{from && to ? box_in_plane(marks, *from, *to) : box(marks.size()),
                          marks.values()};
        });
  }

  /// The grid of a slice in the plane of another one.
  static surf::ImageBox<2> box_in_plane(const Image& slice, const SlicePlace& from,
                                        const SlicePlace& to) {
    const double width = slice.size()[0], height = slice.size()[1];
    surf::Segments corners{surf::Points<2>(3, 2), surf::Elements<2>(0, 2)};
    corners.points.row(0) = slice.pixel_to_plane() * Eigen::Vector2d(0, 0);
    corners.points.row(1) = slice.pixel_to_plane() * Eigen::Vector2d(width, 0);
    corners.points.row(2) = slice.pixel_to_plane() * Eigen::Vector2d(0, height);
    const surf::Points<2> at = in_plane(corners, from, to).points;
    Eigen::Affine2d pixel_to_plane = Eigen::Affine2d::Identity();
    pixel_to_plane.translation() = at.row(0).transpose();
    pixel_to_plane.linear() << (at.row(1) - at.row(0)).transpose() / width,
        (at.row(2) - at.row(0)).transpose() / height;
    return {slice.size(), pixel_to_plane, pixel_to_plane.inverse()};
  }

  const Arguments& arguments_;
  std::optional<Frames> frames_;
};

void add_options(CLI::App& command, Arguments& a) {
  add_image_arguments(command, a.image);
  command.add_option(
      "-o,--output", a.output,
      "Contours to write: .svg, .json, .vtp or .csv; of several objects {object}.json");
  add_curve_options(command, a);
  add_object_option(command, a);
  add_marks_option(command, a, kImageWords);
  const OptionGroup output(command, "Output and running");
  add_output_space(command, a.output_space, "a slice's .vtp", output.name());
  output.add("--mask", a.mask,
             "Mask on the image's pixels, of several objects their labels 1, 2, ...: .png");
  output.add("--picture,--overlay", a.overlay, "Picture of the contours over the image: .png");
  output.add(
      "--start", a.start,
      "The curves that the evolution began with, .json or .csv: given to --contour, with the "
      "energies and lengths under `chosen` of the summary, they give the same bytes again");
  output.add("--denoised", a.denoised,
             "With mumford-shah: the piecewise smooth image: .tif, or .png with its range "
             "mapped to 0..65535");
  output.add("--frames", a.frames, "Folder for such a picture of every step");
  add_candidates_option(command, a);
  add_running_options(command, a);
}

}  // namespace

void add_segment_command(CLI::App& app, ExitCode& exit_code) {
  add_verb<SegmentCurves>(
      app, exit_code,
      {"segment", "Grow or shrink curves in an image",
       "Examples:\n"
       "  curveseg segment cells.png --seeds-grid 20px --energy chan-vese -o cells.svg --mask "
       "cells-mask.png\n"
       "  curveseg segment ring.tif --circle 128,128,120px --energy chan-vese --open-cavities \\\n"
       "          -o ring.json --picture ring.png\n"
       "  curveseg segment head.nii.gz --slice axial:80 --seed 90,110 -o ventricle.json\n"
       "Exit codes: 0 done, 2 usage, 3 input, 4 output, 5 stopped at the iteration limit (result\n"
       "written), 6 result fails a guarantee, 7 some of several objects not written, 8 no object\n"
       "found (not written), 130/143/152 interrupted (last curves written)."},
      add_options);
}

}  // namespace surfseg::curve_program
