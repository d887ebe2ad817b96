// surfseg render: pictures of a surface, in 3-D or over slices of its volume.
#include "libsurf/io/render.h"

#include <memory>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/io/slices.h"
#include "libsurf/volume/read_volume.h"
#include "tools/common/arguments.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

constexpr const char* kFooter =
    "Without --volume: the surface from two sides, from the patient's front right above and from\n"
    "the left. This needs an X display; where there is none, use xvfb-run.\n\n"
    "With --volume: an axial, a coronal and a sagittal slice with the surface's outline, the\n"
    "patient's right on the left; no display needed. R, L, A, P, S and I mark right, left,\n"
    "anterior, posterior, superior and inferior.\n\n"
    "Examples:\n"
    "  surfseg render brain.stl --volume head.nii.gz -o slices.png\n"
    "  xvfb-run -a surfseg render brain.stl -o brain.png";

struct Request {
  std::string surface, volume, output, unstated_space = "lps", space = "ras";
  std::optional<std::string> at;
  std::vector<double> window;
  int frame_index = 0, width = 1500;
  bool has_edges = false;
};

surf::io::Picture draw_slices(const Request& request, const surf::Triangles& surface) {
  surf::volume::ReadOptions read_options;
  read_options.frame_index = request.frame_index;
  const surf::volume::Volume volume = surf::volume::read_volume(request.volume, read_options);
  surf::io::SliceOptions options;
  options.width = request.width;
  if (request.at)
    options.center_ras_mm =
        to_ras_mm(parse_point("--at", *request.at), parse_space("--space", request.space),
                  volume.index_to_world());
  if (!request.window.empty()) options.window = {request.window[0], request.window[1]};
  return surf::io::draw_slices(surface, volume, options);
}

void run(const Request& request) {
  if (surf::extension(request.output) != ".png")
    throw surf::UsageError(fmt::format("--output: '{}' must end in .png", request.output));
  if (request.volume.empty() && (request.at || !request.window.empty()))
    throw surf::UsageError("--at, --window: they belong to slices; give --volume too");
  if (!request.volume.empty() && request.has_edges)
    throw surf::UsageError("--edges: it belongs to the surface alone; leave out --volume");
  const surf::Triangles surface = surf::io::read_surface(
      request.surface,
      {request.unstated_space == "ras" ? surf::io::Space::kRas : surf::io::Space::kLps});
  surf::io::write_png(
      request.output,
      request.volume.empty()
          ? surf::io::render_surface(surface, {request.width, request.width / 2, request.has_edges})
          : draw_slices(request, surface));
}

}  // namespace

void add_render_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command = app.add_subcommand("render", "Draw a surface, alone or over its volume.");
  command->add_option("SURFACE", request->surface, "Surface: .stl, .obj, .ply or .vtp")->required();
  command->add_option("-o,--output", request->output, "Picture to write: .png")->required();
  command->add_option("--volume", request->volume, "Draw slices of this volume with the outline");
  command->add_option("--frame-index", request->frame_index, "Frame of a 4-D volume, from 0")
      ->capture_default_str();
  command->add_option("--at", request->at,
                      "Point X,Y,Z the slices pass through [the surface's centroid]");
  command->add_option("--space", request->space, "Space of --at: ras or lps in mm, or ijk voxels")
      ->check(CLI::IsMember({"ras", "lps", "ijk"}))
      ->capture_default_str();
  command
      ->add_option("--window", request->window,
                   "Values shown as black and white: LOW,HIGH [from the values shown]")
      ->expected(2)
      ->delimiter(',');
  command->add_option("--width", request->width, "Width of the picture in pixels")
      ->capture_default_str();
  command->add_flag("--edges", request->has_edges, "Draw the edges of the triangles");
  command
      ->add_option("--unstated-space", request->unstated_space,
                   "Space of surface files that state none: ras or lps")
      ->check(CLI::IsMember({"ras", "lps"}))
      ->capture_default_str();
  command->footer(kFooter);
  command->callback([request] { run(*request); });
}

}  // namespace surfseg
