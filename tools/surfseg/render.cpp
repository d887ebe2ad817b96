// surfseg render: pictures of a surface, in 3-D or over slices of its volume.
#include "libsurf/io/render.h"

#include <CLI/App.hpp>
#include <memory>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/io/slices.h"
#include "tools/common/arguments.h"
#include "tools/common/option_group.h"
#include "tools/common/outputs.h"
#include "tools/common/volume_arguments.h"
#include "tools/surfseg/commands.h"
#include "tools/surfseg/slice_picture.h"

namespace surfseg {
namespace {

constexpr const char* kFooter =
    "Without --volume: the surface from two sides, from the patient's front right above and from\n"
    "the left. This needs an X display; where there is none, use xvfb-run.\n\n"
    "With --volume: an axial, a coronal and a sagittal slice with the surface's outline, or a\n"
    "--sheet of slices along one axis; the patient's right on the left; no display needed. R, L,\n"
    "A, P, S and I mark right, left, anterior, posterior, superior and inferior, and S12.5 a "
    "slice\n"
    "12.5 mm superior of the origin. A --seed is a green cross where it lies in the slice, else a\n"
    "ring; an --outside point is pink.\n\n"
    "Windows for CT in HU: soft-tissue -160..240, bone -500..1300, lung -1350..150, brain "
    "0..80.\n\n"
    "Examples:\n"
    "  surfseg render brain.stl --volume head.nii.gz -o slices.png\n"
    "  surfseg render kidney.stl --volume ct/ --window soft-tissue --sheet 4x3 -o sheet.png\n"
    "  surfseg render lung.ply --volume ct/ --window lung --seed 90,0,-40 -o lung.png\n"
    "  xvfb-run -a surfseg render brain.stl -o brain.png\n"
    "  xvfb-run -a surfseg render brain.vtp --color-by deviation_mm -o doubt.png";

struct Request {
  std::string surface, volume, output, unstated_space = "lps", space = "ras", axis = "axial";
  std::optional<std::string> at, window, sheet;
  std::vector<std::string> seeds, outside;
  VolumeArguments which;
  int width = 1500;
  bool has_edges = false;
  std::string color_by;
  std::optional<std::string> color_range;

  bool has_slice_options() const {
    return at || window || sheet || !seeds.empty() || !outside.empty();
  }
};

surf::io::SlicePlane plane_of(const std::string& axis) {
  using surf::io::SlicePlane;
  return axis == "coronal"    ? SlicePlane::kCoronal
         : axis == "sagittal" ? SlicePlane::kSagittal
                              : SlicePlane::kAxial;
}

std::vector<surf::io::Mark> marks_of(const Request& request, const surf::volume::Volume& volume) {
  const Space space = parse_space("--space", request.space);
  std::vector<surf::io::Mark> out;
  for (const std::string& seed : request.seeds)
    out.push_back({to_ras_mm(parse_point("--seed", seed), space, volume.index_to_world()), true});
  for (const std::string& point : request.outside)
    out.push_back(
        {to_ras_mm(parse_point("--outside", point), space, volume.index_to_world()), false});
  return out;
}

surf::io::Picture draw_sheet(const Request& request, const surf::Triangles& surface,
                             const surf::volume::Volume& volume) {
  surf::io::SheetOptions options;
  const SheetSize size = parse_sheet("--sheet", *request.sheet);
  options.n_slices = size.n_slices;
  options.columns = size.columns;
  options.plane = plane_of(request.axis);
  options.width = request.width;
  if (request.window) options.window = parse_window("--window", *request.window);
  options.marks = marks_of(request, volume);
  return surf::io::draw_sheet(surface, volume, options);
}

surf::io::Picture draw_slices(const Request& request, const surf::Triangles& surface,
                              const surf::volume::Volume& volume) {
  surf::io::SliceOptions options;
  options.width = request.width;
  if (request.at)
    options.center_ras_mm =
        to_ras_mm(parse_point("--at", *request.at), parse_space("--space", request.space),
                  volume.index_to_world());
  if (request.window) options.window = parse_window("--window", *request.window);
  options.marks = marks_of(request, volume);
  return surf::io::draw_slices(surface, volume, options);
}

/// What can be found wrong before the files are read.
void check(const Request& request) {
  check_picture("--output", request.output);
  if (request.volume.empty() && request.has_slice_options())
    throw surf::UsageError(
        "--at, --window, --sheet, --seed, --outside: they belong to slices; give --volume too");
  if (!request.volume.empty() && request.has_edges)
    throw surf::UsageError("--edges: it belongs to the surface alone; leave out --volume");
  if (!request.volume.empty() && !request.color_by.empty())
    throw surf::UsageError("--color-by: it belongs to the surface alone; leave out --volume");
  if (request.color_range && request.color_by.empty())
    throw surf::UsageError("--color-range: there are no colours; give --color-by too");
  if (request.color_range) parse_window("--color-range", *request.color_range);
  if (request.sheet && request.at)
    throw surf::UsageError(
        "--at: it belongs to three slices; a --sheet is spread over the surface");
  if (request.window) parse_window("--window", *request.window);
  if (request.sheet) parse_sheet("--sheet", *request.sheet);
  for (const std::string& seed : request.seeds) parse_point("--seed", seed);
  for (const std::string& point : request.outside) parse_point("--outside", point);
  request.which.check();
  check_outputs({{"--output", request.output}},
                {{"the surface", request.surface}, {"--volume", request.volume}});
}

surf::io::RenderOptions render_options(const Request& request) {
  surf::io::RenderOptions out{request.width, request.width / 2, request.has_edges};
  if (!request.color_by.empty())
    out.colors = surf::io::PointArray{
        request.color_by, surf::io::read_point_array(request.surface, request.color_by)};
  if (request.color_range) out.range = parse_window("--color-range", *request.color_range);
  return out;
}

void run(const Request& request) {
  check(request);
  const surf::Triangles surface =
      surf::io::read_surface(request.surface, {file_space(request.unstated_space)});
  if (request.volume.empty())
    return surf::io::write_png(request.output,
                               surf::io::render_surface(surface, render_options(request)));
  const surf::volume::Volume volume = request.which.read(request.volume);
  surf::io::write_png(request.output, request.sheet ? draw_sheet(request, surface, volume)
                                                    : draw_slices(request, surface, volume));
}

void add_slice_options(CLI::App& command, Request& request) {
  const OptionGroup group(command, "Slices");
  group.add("--volume", request.volume, "Draw slices of this volume with the outline");
  request.which.add_to(command, group.name());
  group.add("--at", request.at, "Point X,Y,Z the slices pass through [the surface's centroid]");
  group.add("--sheet", request.sheet,
            "Sheet of slices instead, spread evenly over the surface: N or COLUMNSxROWS");
  group.add_choice("--axis", request.axis, "Of the --sheet: axial, coronal or sagittal slices",
                   {"axial", "coronal", "sagittal"});
  group.add("--window", request.window,
            "Values shown as black and white: soft-tissue, bone, lung or brain of a CT, or "
            "LOW,HIGH [from the values shown]");
  group.add_repeatable("--seed", request.seeds, "Point X,Y,Z inside to show; repeat for more");
  group.add_repeatable("--outside", request.outside, "Point outside to show; repeat for more");
  group.add_choice("--space", request.space, "Space of the points: ras or lps in mm, or ijk voxels",
                   {"ras", "lps", "ijk"});
}

}  // namespace

void add_render_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = app.add_subcommand("render", "Draw a surface, alone or over its volume.");
  command->add_option("SURFACE", request->surface, "Surface: .stl, .obj, .ply or .vtp")->required();
  command->add_option("-o,--output", request->output, "Picture to write: .png")->required();
  command->add_option("--width", request->width, "Width of the picture in pixels")
      ->capture_default_str();
  command->add_flag("--edges", request->has_edges, "Draw the edges of the triangles, in 3-D");
  command->add_option("--color-by", request->color_by,
                      "Colour the surface by numbers of its points that a .ply or .vtp holds, such "
                      "as deviation_mm or edge_strength");
  command->add_option("--color-range", request->color_range,
                      "Numbers LOW,HIGH of the first and the last colour [0 and the 98th "
                      "percentile]");
  command
      ->add_option("--unstated-space", request->unstated_space,
                   "Space of surface files that state none: ras or lps")
      ->check(CLI::IsMember({"ras", "lps"}))
      ->capture_default_str();
  add_slice_options(*command, *request);
  command->footer(kFooter);
  command->callback([request] { run(*request); });
}

}  // namespace surfseg
