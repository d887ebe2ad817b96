// surfseg phantom: test volumes whose surface is known exactly.
#include "libsurf/volume/phantom.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/arguments.h"
#include "tools/common/outputs.h"
#include "tools/surfseg/commands.h"

namespace surfseg {
namespace {

using surf::volume::PhantomOptions;

constexpr const char* kFooter =
    "In units u where the volume's shortest side is [-1, 1] and the body's centre is the "
    "volume's:\n"
    "  ball            radius 0.6\n"
    "  two-balls       radius 0.4 about (+-0.4, 0, 0): they touch\n"
    "  separate-balls  radius 0.3 about (+-0.5, 0, 0)\n"
    "  box             half sides 0.6, 0.4, 0.3\n"
    "  torus           about z, radius 0.5 of the centre line, 0.2 of the tube\n"
    "  shell           the ball with a cavity of radius 0.3\n"
    "  vessel          a tree of branches with radii from 0.14 to 0.07\n"
    "  tree            a trunk of radius 0.15 and five branches of 0.1 to 0.11\n"
    "  rods            the ball, bored through by 40 rods of radius 0.022 that do not meet\n"
    "One unit is 1 mm by default; with --spacing the body grows with the volume. Values run\n"
    "smoothly from 1 inside to 0 outside, with 1/2 on the surface.\n\n"
    "Example: surfseg phantom torus --size 96,96,48 --spacing 1,1,2 --noise 0.1 -o torus.nii.gz";

/// The options as they were typed.
struct Request {
  std::string kind, output, size = "128";
  std::optional<std::string> spacing, origin, edge_width;
  std::vector<double> direction;
  double noise = 0;
  std::uint64_t random_seed = 0;
};

/// One value for all three axes, or three.
Eigen::Vector3d parse_one_or_three(const std::string& option, const std::string& text) {
  const bool is_single = text.find(',') == std::string::npos;
  return parse_point(option, is_single ? text + "," + text + "," + text : text);
}

std::array<int, 3> parse_size(const std::string& text) {
  const Eigen::Vector3d size = parse_one_or_three("--size", text);
  for (const double n : size)
    if (n != std::floor(n) || n < 2 || n > 4096)
      throw surf::UsageError(fmt::format(
          "--size: expected N or NX,NY,NZ, whole numbers from 2 to 4096; got '{}'", text));
  return {static_cast<int>(size[0]), static_cast<int>(size[1]), static_cast<int>(size[2])};
}

PhantomOptions options_of(const Request& request) {
  PhantomOptions options;
  options.kind = surf::volume::phantom_kinds().at(request.kind);
  options.size = parse_size(request.size);
  options.noise = request.noise;
  options.random_seed = request.random_seed;
  if (request.spacing) {
    options.spacing_mm = parse_one_or_three("--spacing", *request.spacing);
    if (options.spacing_mm->minCoeff() <= 0)
      throw surf::UsageError(
          fmt::format("--spacing: a spacing must be positive; got '{}'", *request.spacing));
  }
  if (request.origin) options.origin_ras_mm = parse_point("--origin", *request.origin);
  if (!request.direction.empty())
    options.direction =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(request.direction.data());
  if (const std::string error = options.error(); !error.empty()) throw surf::UsageError(error);
  if (request.edge_width) {
    const Length width = parse_length("--edge-width", *request.edge_width);
    options.edge_width_mm =
        width.mm(std::cbrt(std::abs(options.index_to_world().linear().determinant())));
    if (*options.edge_width_mm <= 0)
      throw surf::UsageError("--edge-width: the width must be positive");
  }
  return options;
}

}  // namespace

void add_phantom_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command =
      app.add_subcommand("phantom", "Make a test volume whose surface is known exactly.");
  command->add_option("KIND", request->kind, "Body: " + names_of(surf::volume::phantom_kinds()))
      ->required()
      ->check(CLI::IsMember(surf::volume::phantom_kinds()).description(""));
  command->add_option("-o,--output", request->output, "Volume to write: .nii.gz, .nii, .mha, .nrrd")
      ->required();
  command->add_option("--size", request->size, "Voxels: N or NX,NY,NZ")->capture_default_str();
  command->add_option("--spacing", request->spacing,
                      "Spacing in mm: S or SX,SY,SZ [2/(shortest size - 1)]");
  command
      ->add_option("--direction", request->direction,
                   "Direction matrix, row by row, RAS: 9 numbers; its columns say where the "
                   "indices run to. The body stays as it is in the world [identity]")
      ->expected(9)
      ->delimiter(',');
  command->add_option("--origin", request->origin,
                      "Voxel 0,0,0 in RAS mm: X,Y,Z [the volume's centre is at 0,0,0]");
  command->add_option("--edge-width", request->edge_width,
                      "Half the width of the edge, as 0.1mm or 2vox [0.05 units]");
  command->add_option("--noise", request->noise, "Standard deviation of Gaussian noise")
      ->capture_default_str();
  command->add_option("--random-seed", request->random_seed, "Seed of the noise")
      ->capture_default_str();
  command->footer(kFooter);
  command->callback([request] {
    check_volume_name("-o", request->output);
    check_outputs({{"-o", request->output}});
    if (!(request->noise >= 0 && std::isfinite(request->noise)))
      throw surf::UsageError(fmt::format("--noise: expected 0 or more; got {}", request->noise));
    surf::volume::write_volume(request->output, surf::volume::make_phantom(options_of(*request)));
  });
}

}  // namespace surfseg
