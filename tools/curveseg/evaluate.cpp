// curveseg evaluate: contours against reference contours or a mask.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>

#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/rasterize.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/base/error.h"
#include "libsurf/base/index_box.h"
#include "libsurf/base/memory.h"
#include "libsurf/fem/geometry.h"
#include "tools/common/outputs.h"
#include "tools/common/report.h"
#include "tools/common/say.h"
#include "tools/curveseg/commands.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using nlohmann::ordered_json;
using surf::Segments;
using surf::curve::ContourPixels;
using surf::curve::Image;

constexpr const char* kFooter =
    "CONTOUR is .json or .csv; a reference is such a file, or a mask: an image, or with --slice a "
    "slice\n"
    "of a label map, whose pixels that are not 0 (or are --label) are the object. Dice counts "
    "pixel\n"
    "centres: those of the mask, carried on as far as the contours reach, or of a grid with 1024\n"
    "along the longer side of both contours; it is unknown where none lies in either of them.\n"
    "Distances are between contours, both ways; against a mask there are none. Contours of a\n"
    "slice (.json) are compared in the world with a label map and with those of another slice,\n"
    "whose grid may be another one; the planes have to be the same.\n\n"
    "Examples:\n"
    "  curveseg evaluate blob.json --reference blob-exact.json\n"
    "  curveseg evaluate tumour.json --reference tumour-by-hand.png --json scores.json";

struct Request {
  std::string contour, json;
  ImageArguments reference;
  std::optional<double> label;
};

struct Overlap {
  std::size_t n_first = 0, n_second = 0, n_both = 0;
  double pixel_mm2 = 0;

  /// Both may lie between the pixels' centres; the scores are unknown then.
  bool is_empty() const { return n_first + n_second == 0; }
  double dice() const { return 2.0 * double(n_both) / double(n_first + n_second); }
  double jaccard() const { return double(n_both) / double(n_first + n_second - n_both); }
};

/// Contours to compare.
/// @throws surf::InputError  cannot be read, or have no length
Segments read_compared(const std::string& path) {
  Segments out = surf::curve::read_contours(path);
  double length = 0;
  for (const auto element : out.elements.rowwise())
    length += (out.points.row(element[1]) - out.points.row(element[0])).norm();
  if (!(length > 0 && std::isfinite(length)))
    throw surf::InputError(fmt::format(
        "{}: its contours have a length of {} mm, so that nothing can be compared", path, length));
  return out;
}

template <class First, class Second>
Overlap count(std::size_t n, double pixel_mm2, const First& first, const Second& second) {
  Overlap out;
  out.pixel_mm2 = pixel_mm2;
  for (std::size_t at = 0; at < n; ++at) {
    const bool a = first(at), b = second(at);
    out.n_first += a;
    out.n_second += b;
    out.n_both += a && b;
  }
  return out;
}

/// The mask's pixels, and those beyond them that the curves may reach.
surf::IndexBox<2> pixels_of(const Request& request, const Segments& curves, const Image& mask) {
  constexpr double kMost = 1e9;       // pixels: some seconds
  constexpr int kFarthest = 1 << 29;  // pixel, so that sizes and sums stay within an int
  constexpr double kRow = 24;         // bytes that rasterize() needs for a row beside its pixels
  Eigen::AlignedBox2d box(Eigen::Vector2d(0, 0),
                          Eigen::Vector2d(mask.size()[0] - 1, mask.size()[1] - 1));
  for (const auto point : curves.points.rowwise())
    box.extend(mask.plane_to_pixel() * Eigen::Vector2d(point.transpose()));
  const Eigen::Vector2d lower = (box.min().array() + 0.5).floor(),
                        upper = (box.max().array() + 0.5).floor() + 1, size = upper - lower;
  const double farthest = std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff());
  if (!(farthest <= kFarthest && size.prod() <= std::max(kMost, 2.0 * double(mask.n_pixels())) &&
        surf::fits_in_memory((size[0] + kRow) * size[1])))
    throw surf::InputError(fmt::format(
        "{} and {} together span the pixels ({:.4g}, {:.4g}) to ({:.4g}, {:.4g}) of the latter, "
        "which has {} x {}: too many to compare; are the contours in another unit or place?",
        request.contour, request.reference.path, lower[0], lower[1], upper[0] - 1, upper[1] - 1,
        mask.size()[0], mask.size()[1]));
  return surf::IndexBox<2>::between({int(lower[0]), int(lower[1])}, {int(upper[0]), int(upper[1])});
}

Overlap overlap_with_mask(const Request& request, const Segments& curves, const Image& mask) {
  const surf::IndexBox<2> pixels = pixels_of(request, curves, mask), of_mask{{0, 0}, mask.size()};
  Eigen::Affine2d to_plane = mask.pixel_to_plane();
  to_plane.translate(Eigen::Vector2d(pixels.lower[0], pixels.lower[1]));
  const auto inside = surf::curve::rasterize(curves, pixels.size, to_plane);
  return count(
      pixels.n(), mask.pixel_size() * mask.pixel_size(),
      [&](std::size_t at) { return inside[at] != 0; },
      [&](std::size_t at) {
        const auto pixel = pixels.node(at);
        if (!of_mask.contains(pixel)) return false;
        const float value = mask.value(pixel[0], pixel[1]);
        return request.label ? double(value) == *request.label : value != 0;
      });
}

Overlap overlap_of(const Segments& first, const Segments& second) {
  constexpr int kSide = 1024;
  Eigen::AlignedBox2d box;
  for (const Segments* curves : {&first, &second})
    for (const auto point : curves->points.rowwise())
      box.extend(Eigen::Vector2d(point.transpose()));
  const double pixel = box.sizes().maxCoeff() / kSide;
  const std::array<int, 2> size = {int(box.sizes()[0] / pixel) + 1,
                                   int(box.sizes()[1] / pixel) + 1};
  Eigen::Affine2d to_plane = Eigen::Affine2d::Identity();
  to_plane.linear() *= pixel;
  to_plane.translation() = box.min().array() + pixel / 2;
  const auto a = surf::curve::rasterize(first, size, to_plane),
             b = surf::curve::rasterize(second, size, to_plane);
  return count(
      a.size(), pixel * pixel, [&](std::size_t at) { return a[at] != 0; },
      [&](std::size_t at) { return b[at] != 0; });
}

/// A mask that states no pixel size has that of the image in which the contours were found, if it
/// has as many pixels; masks that are written beside contours are such.
Image on_pixels_of_contours(const Request& request, const std::optional<ContourPixels>& pixels,
                            Image mask) {
  if (mask.source().spacing_source != "unknown") return mask;
  if (!pixels)
    say("note: neither {} nor {} states a pixel size; pixels count as 1 mm (--spacing)\n",
        request.reference.path, request.contour);
  else if (pixels->size != mask.size())
    say("note: {} states no pixel size and has {} x {} pixels, not the {} x {} that {} was found "
        "on; pixels count as 1 mm (--spacing)\n",
        request.reference.path, mask.size()[0], mask.size()[1], pixels->size[0], pixels->size[1],
        request.contour);
  if (!pixels || pixels->size != mask.size() || pixels->to_plane.isApprox(mask.pixel_to_plane()))
    return mask;
  const Image out(mask.size(), pixels->to_plane, mask.values(), mask.source());
  say("note: {} states no pixel size; its pixels are taken for those of {}, {:.6g} x {:.6g} mm\n",
      request.reference.path, request.contour, out.spacing()[0], out.spacing()[1]);
  return out;
}

void check_label(const Request& request, const Image& mask) {
  if (!request.label) return;
  if (std::none_of(mask.values().begin(), mask.values().end(),
                   [&](float value) { return double(value) == *request.label; }))
    throw surf::InputError(
        fmt::format("{}: no pixel has the label {}", request.reference.path, *request.label));
}

ordered_json distances_of(const Segments& first, const Segments& second) {
  const auto d = surf::curve::curve_distances(first, second);
  return {{"mean_mm", d.mean_mm}, {"rms_mm", d.rms_mm}, {"p95_mm", d.p95_mm}, {"max_mm", d.max_mm}};
}

double area_of(const Segments& curves) {
  return surf::fem::Geometry<2>(curves.points, curves.elements).enclosed();
}

ordered_json evaluate(const Request& request) {
  const Segments curves = read_compared(request.contour);
  const auto pixels = surf::curve::pixels_of_contours(request.contour);
  const auto place = place_of(request.contour, pixels);
  const auto verification = surf::curve::verify(curves);
  ordered_json scores = {{"contour", request.contour}, {"reference", request.reference.path}};
  Overlap overlap;
  ordered_json distance;
  if (surf::curve::is_readable_contour(request.reference.path)) {
    if (request.label)
      throw surf::UsageError(
          fmt::format("--label: {} holds contours and no labels", request.reference.path));
    for (const auto& [option, value] :
         {std::pair{"--slice", request.reference.slice}, {"--spacing", request.reference.spacing}})
      if (!value.empty())
        throw surf::UsageError(fmt::format("{}: {} holds contours, whose millimetres are its own",
                                           option, request.reference.path));
    request.reference.which.check_unused(request.reference.path, "holds contours");
    const Segments reference = read_compared(request.reference.path);
    const auto theirs = surf::curve::pixels_of_contours(request.reference.path);
    const Segments found = in_plane(curves, place, place_of(request.reference.path, theirs));
    overlap = overlap_of(found, reference);
    distance = distances_of(found, reference);
    scores["reference_area_mm2"] = area_of(reference);
  } else {
    const Image mask = on_pixels_of_contours(request, pixels, request.reference.read());
    check_label(request, mask);
    overlap = overlap_with_mask(request, in_plane(curves, place, place_of(mask)), mask);
    scores["reference_area_mm2"] = double(overlap.n_second) * overlap.pixel_mm2;
  }
  scores["area_mm2"] = area_of(curves);
  scores["dice"] = overlap.is_empty() ? ordered_json() : ordered_json(overlap.dice());
  scores["jaccard"] = overlap.is_empty() ? ordered_json() : ordered_json(overlap.jaccard());
  scores["distance"] = distance;
  scores["verification"] = {{"passed", verification.passed()},
                            {"message", verification.message()},
                            {"components", verification.n_components},
                            {"elements", verification.n_elements}};
  return scores;
}

std::string text_of(const ordered_json& scores) {
  KeyValues lines(18);
  const auto number = [&](const ordered_json& value, const char* unit) {
    return fmt::format("{:.4f}{}", value.get<double>(), unit);
  };
  if (scores["dice"].is_null()) {
    lines.add("overlap", "unknown: no pixel's centre lies in either of them");
  } else {
    lines.add("Dice", number(scores["dice"], ""));
    lines.add("Jaccard", number(scores["jaccard"], ""));
  }
  lines.add("area", number(scores["area_mm2"], " mm2"));
  lines.add("reference area", number(scores["reference_area_mm2"], " mm2"));
  if (const auto& distance = scores["distance"]; !distance.is_null()) {
    lines.add("mean distance", number(distance["mean_mm"], " mm"));
    lines.add("RMS distance", number(distance["rms_mm"], " mm"));
    lines.add("95 % distance", number(distance["p95_mm"], " mm"));
    lines.add("maximum distance", number(distance["max_mm"], " mm"));
  }
  lines.add("verification", scores["verification"]["message"].get<std::string>());
  return lines.text();
}

}  // namespace

void add_evaluate_command(CLI::App& app, ExitCode&) {
  const auto request = std::make_shared<Request>();
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare contours with reference contours or a mask");
  command->add_option("CONTOUR", request->contour, "Contours: .json or .csv")->required();
  command->add_option("--reference", request->reference.path, "Contours or mask to compare with")
      ->required();
  command->add_option("--slice", request->reference.slice,
                      "Slice of a label map, such as axial:120");
  command->add_option("--spacing", request->reference.spacing,
                      "Pixel size of a mask in mm, S or SX,SY [what the file states, else that of "
                      "the image that .json contours name, if it has as many pixels, else 1]");
  command->add_option("--label", request->label, "Label of the object in the mask");
  request->reference.which.add_to(*command);
  command->add_option("--json", request->json, "Write the scores to this file");
  command->footer(kFooter);
  command->callback([request] {
    check_outputs({{"--json", request->json}},
                  {{"the contours", request->contour}, {"--reference", request->reference.path}});
    const ordered_json scores = evaluate(*request);
    if (!request->json.empty()) write_json(request->json, scores);
    const std::string text = text_of(scores);
    std::fwrite(text.data(), 1, text.size(), stdout);
  });
}

}  // namespace surfseg::curve_program
