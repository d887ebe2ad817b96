// curveseg phantom: test images whose contour is known exactly.
#include "libcurve/image/phantom.h"

#include <fmt/format.h>

#include <CLI/App.hpp>

#include "libcurve/image/write_image.h"
#include "libcurve/io/contour_file.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/common/arguments.h"
#include "tools/common/outputs.h"
#include "tools/curveseg/commands.h"

namespace surfseg::curve_program {
namespace {

using surf::curve::PhantomOptions;

constexpr const char* kFooter =
    "In units u where the image's shortest side is [-1, 1], y downwards:\n"
    "  blob     r(t) = 0.5 (1 + 0.15 cos 3t)\n"
    "  discs12  twelve separate discs of radius 0.12 to 0.26\n"
    "  ring     radii 0.6 and 0.3 about (0.05, -0.03)\n"
    "  bay      corners, a cusp at (0.8, 0) and a concavity 0.6 deep\n"
    "Values are (1 + erf(2 s / eps)) / 2 with s the distance, positive inside, and eps the edge "
    "width:\n"
    "1 inside, 0 outside, 1/2 on the contour. A .png has 16 bits from the least to the largest "
    "value.\n\n"
    "Example: curveseg phantom ring --edge-width 0.02 --noise 0.1 -o ring.tif --contour ring.json";

/// The options as they were typed.
struct Request {
  std::string kind, output, contour, size = "256", spacing = "1", wave;
  PhantomOptions options;
};

std::vector<double> one_or_two(const std::string& option, const std::string& text,
                               const std::string& expected) {
  const bool is_single = text.find(',') == std::string::npos;
  return parse_numbers(option, is_single ? text + "," + text : text, 2, expected);
}

PhantomOptions options_of(const Request& request) {
  PhantomOptions options = request.options;
  options.kind = surf::curve::phantom_kinds().at(request.kind);
  const auto size = one_or_two("--size", request.size, "N or NX,NY");
  for (const double n : size)
    if (n != std::floor(n) || n < 2 || n > 32768)
      throw surf::UsageError(fmt::format(
          "--size: expected N or NX,NY, whole numbers from 2 to 32768; got '{}'", request.size));
  options.size = {int(size[0]), int(size[1])};
  const auto spacing = one_or_two("--spacing", request.spacing, "S or SX,SY in mm");
  options.spacing_mm = {spacing[0], spacing[1]};
  if (!request.wave.empty()) {
    const auto wave = parse_numbers("--wave", request.wave, 2, "two numbers A,N");
    options.wave_amplitude = wave[0];
    options.wave_periods = wave[1];
  }
  if (const std::string error = options.error(); !error.empty()) throw surf::UsageError(error);
  return options;
}

void run(const Request& request) {
  if (!surf::curve::is_writable_image(request.output))
    throw surf::UsageError(
        fmt::format("-o: {}: expected a name that ends in .tif or .png", request.output));
  if (!request.contour.empty() && !surf::curve::is_writable_contour(request.contour))
    throw surf::UsageError(fmt::format(
        "--contour: {}: expected a name that ends in .svg, .json, .vtp or .csv", request.contour));
  check_outputs({{"-o", request.output}, {"--contour", request.contour}});
  const PhantomOptions options = options_of(request);
  const surf::curve::Image image = surf::curve::make_phantom(options);
  surf::curve::write_image(request.output, image);
  if (!request.contour.empty())
    surf::curve::write_contours(request.contour, surf::curve::phantom_contour(options), image);
}

}  // namespace

void add_phantom_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  PhantomOptions& options = request->options;
  CLI::App* command =
      app.add_subcommand("phantom", "Make a test image whose contour is known exactly");
  command->add_option("KIND", request->kind, "Object: " + names_of(surf::curve::phantom_kinds()))
      ->required()
      ->check(CLI::IsMember(surf::curve::phantom_kinds()).description(""));
  command->add_option("-o,--output", request->output, "Image to write: .tif (floats) or .png")
      ->required();
  command->add_option("--contour", request->contour, "Write the exact contour too");
  command->add_option("--size", request->size, "Pixels: N or NX,NY")->capture_default_str();
  command->add_option("--spacing", request->spacing, "Pixel size in mm: S or SX,SY")
      ->capture_default_str();
  command->add_option("--edge-width", options.edge_width, "Width eps of the edge, in units")
      ->capture_default_str();
  command->add_option("--noise", options.noise, "Standard deviation of Gaussian noise")
      ->capture_default_str();
  command->add_option("--random-seed", options.random_seed, "Seed of the noise")
      ->capture_default_str();
  command
      ->add_option("--slope", options.linear_background, "Background m / 4 (2 + x + y) with this m")
      ->capture_default_str();
  command->add_option("--wave", request->wave, "Background A cos(pi x / (N eps)): A,N");
  command->footer(kFooter);
  command->callback([request] { run(*request); });
}

}  // namespace surfseg::curve_program
