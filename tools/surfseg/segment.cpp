// surfseg segment: a volume and seeds in, a verified surface out.
#include "libsurf/segment/segment.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/segment/denoised.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/arguments.h"
#include "tools/common/idle_options.h"
#include "tools/common/option_group.h"
#include "tools/common/run_arguments.h"
#include "tools/common/strokes.h"
#include "tools/common/verb.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/initial_surface.h"
#include "tools/surfseg/slice_picture.h"
#include "tools/surfseg/surface_command.h"

namespace surfseg {
namespace {

surf::ImageBox<3> box_of(const surf::volume::Volume& volume) {
  return {volume.size(), volume.index_to_world(), volume.world_to_index()};
}

/// The options as they were typed.
struct Arguments : RunArguments, SurfaceFiles {
  std::string space = "ras";
  InitialArguments initial;
  std::string denoised, start;
};

class SegmentSurface : public SurfaceCommand {
 public:
  SegmentSurface(const CLI::App& command, const Arguments& arguments)
      : SurfaceCommand(command, arguments, arguments), arguments_(arguments) {}

  /// All but names of files.
  void check_values() const {
    check_run_arguments(command(), arguments_, kVolumeWords);
    if (arguments_.keep == "seeded" && arguments_.seeds.empty() && arguments_.marks.empty() &&
        !arguments_.initial.is_body())
      throw surf::UsageError("--keep seeded: a --seed in each component to keep is needed");
    for (const std::string& seed : arguments_.seeds) parse_point("--seed", seed);
    for (const std::string& point : arguments_.outside) parse_point("--outside", point);
    for (const std::string& box : arguments_.boxes) split_box("--box", box, 3);
    arguments_.initial.check();
    if (!arguments_.objects.empty() && arguments_.initial.any())
      throw surf::UsageError(
          "--object: each is looked for from its own --seed, not from an initial surface");
    if (arguments_.seeds.empty() && arguments_.marks.empty() && !arguments_.initial.any())
      throw surf::UsageError(
          "--seed: at least one point inside the object is needed, such as --seed 12.5,-30,44, or "
          "--marks, or an --initial surface");
  }

 protected:
  void check() const override {
    if (arguments_.volume.empty()) throw surf::UsageError("VOLUME: a volume is missing");
    check_values();
    check_names();
    check_objects(command(), arguments_,
                  {{"-o", arguments_.output},
                   {"--denoised", arguments_.denoised},
                   {"--start", arguments_.start}});
    arguments_.check_reference(arguments_.objects);
    std::vector<Output> outputs = arguments_.outputs();
    outputs.insert(outputs.end(), {{"--denoised", arguments_.denoised},
                                   {"--start", arguments_.start},
                                   {"--recipe", arguments_.recipe},
                                   {"--checkpoint", checkpoint_path()},
                                   {"--json", arguments_.json}});
    std::vector<Output> inputs =
        read_files(arguments_, {{"the input", arguments_.volume},
                                {"--reference", arguments_.reference},
                                {"--initial", arguments_.initial.file},
                                {"--landmarks", arguments_.initial.landmarks}});
    const auto candidates = candidate_outputs(arguments_, arguments_.output, inputs);
    outputs.insert(outputs.end(), candidates.begin(), candidates.end());
    check_outputs(object_outputs(outputs, arguments_.objects),
                  object_outputs(inputs, arguments_.objects));
  }

  Input read() override {
    auto setting = open(arguments_.volume);
    return {std::move(setting), objects_of<3>(command(), arguments_, options(image()),
                                              boxes_mm(image()), strokes(image()))};
  }

  std::vector<std::string> idle_options() const override {
    return surfseg::idle_options(command(), arguments_, arguments_.initial.any());
  }

  void write(const surf::segment::Object<3>& object,
             const surf::segment::Finished<3>& finished) const override {
    SurfaceCommand::write(object, finished);
    const auto path = [&](const std::string& pattern) { return object_path(pattern, object.name); };
    if (const auto model = surf::segment::piecewise_smooth<3>(object.result->energies);
        model && !arguments_.denoised.empty())
      surf::volume::write_volume(path(arguments_.denoised),
                                 surf::segment::denoised(image(), finished.shape, model->mu));
    if (!arguments_.start.empty())
      surf::io::write_surface(path(arguments_.start), object.result->start,
                              arguments_.write_options());
  }

 private:
  void check_names() const {
    arguments_.SurfaceFiles::check();
    if (!arguments_.start.empty() && surf::extension(arguments_.start) != ".vtp")
      throw surf::UsageError(
          fmt::format("--start: {}: expected a name that ends in .vtp, which holds every digit",
                      arguments_.start));
    check_volume_name("--denoised", arguments_.denoised);
    if (!arguments_.denoised.empty() &&
        !surf::segment::is_piecewise_smooth<3>(arguments_.terms(command())))
      throw surf::UsageError(
          "--denoised: only the Mumford-Shah model has such a volume; add --energy mumford-shah");
  }

  /// Of each label map.
  std::vector<std::vector<surf::segment::Click<3>>> strokes(
      const surf::volume::Volume& volume) const {
    const bool has_inside = !arguments_.seeds.empty() || arguments_.initial.any();
    return strokes_of<3>(arguments_.marks, box_of(volume), has_inside,
                         [&](const std::string& path) {
                           const surf::volume::Volume marks = surf::volume::read_volume(path);
                           const auto& size = marks.size();
                           std::vector<float> labels(std::size_t(size[0]) * size[1] * size[2]);
                           marks.copy_box({0, 0, 0}, size, labels.data());
                           return Marks<3>{box_of(marks), std::move(labels)};
                         });
  }

  std::vector<surf::segment::BoxCorners<3>> boxes_mm(const surf::volume::Volume& volume) const {
    const Space space = parse_space("--space", arguments_.space);
    const auto at = [&](const std::string& corner) {
      return to_ras_mm(parse_point("--box", corner), space, volume.index_to_world());
    };
    std::vector<surf::segment::BoxCorners<3>> out;
    for (const std::string& box : arguments_.boxes) {
      const auto corners = split_box("--box", box, 3);
      const surf::segment::BoxCorners<3> corners_mm{at(corners[0]), at(corners[1])};
      out.push_back(space == Space::kIjk
                        ? corners_mm
                        : surf::segment::holding_box_along_world<3>(box_of(volume), corners_mm));
    }
    return out;
  }

  surf::segment::Options<3> options(const surf::volume::Volume& volume) const {
    const Space space = parse_space("--space", arguments_.space);
    surf::segment::Options<3> out;
    for (const std::string& seed : arguments_.seeds)
      out.seeds_mm.push_back(
          to_ras_mm(parse_point("--seed", seed), space, volume.index_to_world()));
    for (const std::string& point : arguments_.outside)
      out.outside_mm.push_back(
          to_ras_mm(parse_point("--outside", point), space, volume.index_to_world()));
    set_run_options<3>(command(), arguments_, volume.voxel_size(), out);
    if (arguments_.initial.any()) set_initial_surface(out, space, volume);
    return out;
  }

  /// Parameters are chosen at the centre of a body if there is no seed.
  void set_initial_surface(surf::segment::Options<3>& out, Space space,
                           const surf::volume::Volume& volume) const {
    InitialSurface initial = make_initial_surface(
        arguments_.initial, space, volume, out.edge_length_mm.value_or(1.5 * volume.voxel_size()));
    out.initial = std::move(initial.surface);
    if (out.seeds_mm.empty() && initial.center_ras_mm)
      out.samples_mm.push_back(*initial.center_ras_mm);
  }

  const Arguments& arguments_;
};

void add_options(CLI::App& command, Arguments& a) {
  command.add_option(
      "VOLUME", a.volume,
      "NIfTI, MetaImage, NRRD, VTI or OpenVDB file, a DICOM folder or one of its files");
  command.add_option("-o,--output", a.output,
                     fmt::format("Surface to write: {}; of several objects organs/{{object}}.stl",
                                 surf::io::writable_surfaces()));
  a.which.add_to(command);

  add_start_options(command, a, kVolumeWords);
  add_object_option(command, a);
  add_marks_option(command, a, kVolumeWords);
  const OptionGroup start(command, "Where to start");
  start.add_choice("--space", a.space, "Space of the points: ras or lps in mm, or ijk voxels",
                   {"ras", "lps", "ijk"});
  start.add("--initial", a.initial.file,
            "Initial surface of an evolution in place of seed balls: a mesh or a label map");
  start.add("--initial-ball", a.initial.ball, "Or a ball X,Y,Z,RADIUS: 12,-30,44,10mm");
  start.add("--initial-ellipsoid", a.initial.ellipsoid,
            "Or an ellipsoid X,Y,Z,A,B,C along the axes of --space: 12,-30,44,10mm,8mm,15mm");
  start.add("--initial-box", a.initial.box,
            "Or a box along the axes of --space from corner to corner: 0,-40,20,25,-10,50");
  start.add("--landmarks", a.initial.landmarks,
            "Or the ellipsoid next to points on the object: Slicer's .mrk.json or .fcsv, or X Y "
            "Z a line in --space");
  start.add_with_default("--initial-label", a.initial.label, "Label to take from the label map");
  add_run_options(command, a, kVolumeWords);

  const OptionGroup output(command, "Output and running");
  add_output_space(command, a.output_space, "the file", output.name());
  output.add("--mask", a.mask,
             fmt::format("Label map on the volume's grid, objects 1, 2, ... in their order: {}",
                         surf::volume::writable_label_maps()));
  add_picture_option(command, a.picture, output.name());
  add_thumbnail_option(command, a.thumbnail, output.name());
  add_report_options(command, a, output.name());
  output.add("--start", a.start,
             "The surface that the evolution began with, .vtp: given to --initial, with the "
             "energies and lengths under `chosen` of the summary, it gives the same bytes again");
  output.add("--denoised", a.denoised,
             "Volume approximated smoothly inside and outside the surface, which "
             "mumford-shah finds along with it: .nii.gz, .nii, .mha, .nrrd");
  add_candidates_option(command, a);
  add_running_options(command, a);
}

}  // namespace

void check_segment(std::vector<std::string> words) {
  Arguments arguments;
  CLI::App command{"", "segment"};
  add_options(command, arguments);
  std::reverse(words.begin(), words.end());  // as the parser wants them
  command.parse(std::move(words));
  apply_files(command, arguments.config, arguments.preset);
  const SegmentSurface segment(command, arguments);
  segment.check_values();
  arguments.which.check();
  check_objects(command, arguments, {});
}

void add_segment_command(CLI::App& app, ExitCode& exit_code) {
  add_verb<SegmentSurface>(
      app, exit_code,
      {"segment", "Grow a surface from seeds in a volume",
       "Examples:\n"
       "  surfseg segment head.nii.gz --seed 3,-20,35 -o brain.stl\n"
       "  surfseg segment ct/ --seed 120,88,40 --space ijk --radius 8mm -o kidney.ply --mask "
       "kidney.nii.gz\n"
       "  surfseg segment mr.nrrd --seed -12,40,7 --energy window:mean=380,half-width=150 \\\n"
       "          --energy area:weight=2 --json summary.json -o tumour.obj\n"
       "  surfseg segment ct.nii.gz --object liver --seed 95,182,373 --object kidney \\\n"
       "          --seed 60,150,380 -o {object}.stl --mask labels.nii.gz --recipe organs.json\n"
       "Exit codes: 0 done, 2 usage, 3 input, 4 output, 5 stopped at the iteration limit (result\n"
       "written), 6 result fails a guarantee, 7 some of several objects not written, 8 no object\n"
       "found (not written), 130/143/152 interrupted (last surface written)."},
      add_options);
}

}  // namespace surfseg
