#include "tools/curveseg/curve_run.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>

#include "libcurve/io/contour_file.h"
#include "libcurve/mesh/primitives.h"
#include "libcurve/segment/seed_grid.h"
#include "libsurf/base/error.h"
#include "libsurf/io/read_landmarks.h"
#include "libsurf/mesh/fit_ellipsoid.h"
#include "tools/common/arguments.h"
#include "tools/common/idle_options.h"
#include "tools/common/option_group.h"
#include "tools/curveseg/image_arguments.h"

namespace surfseg::curve_program {
namespace {

using surf::Segments;
using surf::UsageError;
using surf::curve::Image;

/// "X,Y,RADIUS": the last comma parts point and length.
std::pair<std::string, std::string> split_circle(const std::string& text) {
  const std::size_t comma = text.rfind(',');
  if (comma == std::string::npos || std::count(text.begin(), text.end(), ',') < 2)
    throw UsageError(fmt::format(
        "--circle: expected X,Y,RADIUS, the radius with its unit, such as 120,88,30px; got '{}'",
        text));
  return {text.substr(0, comma), text.substr(comma + 1)};
}

Segments grid_of_seeds(const CurveArguments& a, const Image& image, double edge_length) {
  const double pixel = image.pixel_size();
  surf::curve::SeedGridOptions options;
  options.spacing_mm = parse_positive_length("--seeds-grid", a.seeds_grid).mm(pixel);
  if (!a.radius.empty()) options.radius_mm = parse_positive_length("--radius", a.radius).mm(pixel);
  options.edge_length_mm = edge_length;
  options.are_dark = a.dark;
  return surf::curve::seed_grid(image, options);
}

/// In the plane of the image, from px, mm or, of a slice, from space.
surf::mesh::Ellipsoid<2> ellipse_at(const CurveArguments& a, const Image& image) {
  const surf::io::Landmarks landmarks = surf::io::read_landmarks(a.landmarks);
  const bool is_flat = landmarks.points.cols() == 2;
  const std::string space = landmarks.is_ras ? "ras" : a.space;
  surf::Points<2> points(landmarks.points.rows(), 2);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto row = landmarks.points.row(i);
    points.row(i) = parse_plane_point("--landmarks",
                                      is_flat ? fmt::format("{},{}", row[0], row[1])
                                              : fmt::format("{},{},{}", row[0], row[1], row[2]),
                                      space, image);
  }
  return surf::mesh::fit_ellipsoid<2>(points);
}

Segments initial_curves(const CurveArguments& a, const Image& image, double edge_length) {
  std::vector<Segments> parts;
  for (const std::string& text : a.circles) {
    const auto [point, radius] = split_circle(text);
    const double r = parse_positive_length("--circle", radius).mm(image.pixel_size());
    parts.push_back(surf::curve::circle(parse_plane_point("--circle", point, a.space, image), r,
                                        std::min(edge_length, r / 4)));
  }
  if (!a.seeds_grid.empty()) parts.push_back(grid_of_seeds(a, image, edge_length));
  if (!a.landmarks.empty()) {
    const auto fit = ellipse_at(a, image);
    parts.push_back(surf::curve::ellipse(fit.center, fit.axes,
                                         std::min(edge_length, fit.axes.col(1).norm() / 4)));
  }
  if (!a.contour.empty()) {
    parts.push_back(surf::curve::read_contours(a.contour));
    const auto check = surf::curve::verify(parts.back());
    if (!check.passed()) throw surf::InputError(fmt::format("{}: {}", a.contour, check.message()));
    // Each slice counts its millimetres from its own first pixel.
    const auto theirs = surf::curve::pixels_of_contours(a.contour);
    parts.back() = in_plane(parts.back(), place_of(a.contour, theirs), place_of(image));
  }
  return surf::curve::joined(parts);
}

}  // namespace

void add_curve_options(CLI::App& command, CurveArguments& a) {
  add_start_options(command, a, kImageWords);
  const OptionGroup start(command, "Where to start");
  start.add_choice("--space", a.space,
                   "Space of the points: px (column, row) or mm of the image; ras or lps, X,Y,Z in "
                   "mm, of a slice",
                   {"px", "mm", "ras", "lps"});
  start.add_repeatable(
      "--circle", a.circles,
      "Or a circle X,Y,RADIUS to start from, such as 120,88,30px; repeat for more");
  start.add("--seeds-grid", a.seeds_grid,
            "Or circles at this distance, such as 20px, where the image is brighter than its mean");
  start.add_flag("--dark", a.dark, "With --seeds-grid: where it is darker");
  start.add("--contour", a.contour, "Or the contours of a .json or .csv file");
  start.add("--landmarks", a.landmarks,
            "Or the ellipse next to points on the object: X Y a line in --space, or, on a "
            "slice, Slicer's .mrk.json or .fcsv");
  add_run_options(command, a, kImageWords);
  OptionGroup(command, "Image")
      .add_choice("--sampling", a.sampling,
                  "Values between pixels: spline (C^2, the default) or linear",
                  {"spline", "linear"});
}

void check_contour_output(const std::string& output) {
  if (output.empty())
    throw surf::UsageError("-o: an output file is missing, such as -o liver.json");
  if (!surf::curve::is_writable_contour(output))
    throw surf::UsageError(
        fmt::format("-o: {}: expected a name that ends in .svg, .json, .vtp or .csv", output));
}

void check_curve_arguments(const CLI::App& command, const CurveArguments& a) {
  check_run_arguments(command, a, kImageWords);
  for (const std::string& text : a.circles)
    parse_positive_length("--circle", split_circle(text).second);
  if (!a.seeds_grid.empty()) parse_positive_length("--seeds-grid", a.seeds_grid);
  if (!a.contour.empty() && !surf::curve::is_readable_contour(a.contour))
    throw UsageError(
        fmt::format("--contour: {}: expected a name that ends in .json or .csv", a.contour));
  const int n_initial = int(!a.circles.empty()) + int(!a.contour.empty()) +
                        int(!a.seeds_grid.empty()) + int(!a.landmarks.empty());
  if (n_initial > 1)
    throw UsageError("--circle, --seeds-grid, --contour, --landmarks: give one of them");
  const bool has_seed = !a.seeds.empty() || !a.marks.empty();
  if (!has_seed && !a.has_initial())
    throw UsageError(
        "--seed: at least one point inside the object is needed, such as --seed 120,88, or "
        "--marks, a --circle, --seeds-grid, --contour or --landmarks");
  if (!has_seed && a.terms(command).empty() && a.circles.size() != 1 && a.landmarks.empty())
    throw UsageError(
        "--energy: without a --seed inside the object an energy is needed, such as --energy "
        "chan-vese");
  if (a.keep == "seeded" && !has_seed)
    throw UsageError("--keep seeded: a --seed in each component to keep is needed");
}

std::vector<std::string> idle_curve_options(const CLI::App& command, const CurveArguments& a) {
  std::vector<std::string> out = idle_options(command, a, a.has_initial() && a.seeds_grid.empty());
  if (a.dark && a.seeds_grid.empty()) out.push_back("--dark has no effect without --seeds-grid");
  return out;
}

surf::curve::CurveOptions curve_options(const CLI::App& command, const CurveArguments& a,
                                        const Image& image) {
  surf::curve::CurveOptions out;
  set_run_options<2>(command, a, image.pixel_size(), out);
  if (a.sampling == "linear") out.interpolation = surf::volume::Interpolation::kLinear;
  for (const std::string& seed : a.seeds)
    out.seeds_mm.push_back(parse_plane_point("--seed", seed, a.space, image));
  for (const std::string& point : a.outside)
    out.outside_mm.push_back(parse_plane_point("--outside", point, a.space, image));
  if (a.has_initial())
    out.initial = initial_curves(a, image, out.edge_length_mm.value_or(1.5 * image.pixel_size()));
  if (out.seeds_mm.empty() && !a.landmarks.empty())
    out.samples_mm.push_back(ellipse_at(a, image).center);
  // Parameters are chosen at the centre of a circle if there is no seed.
  if (out.seeds_mm.empty() && a.circles.size() == 1)
    out.samples_mm.push_back(
        parse_plane_point("--circle", split_circle(a.circles[0]).first, a.space, image));
  return out;
}

std::vector<surf::segment::BoxCorners<2>> boxes_mm(const CurveArguments& a, const Image& image) {
  std::vector<surf::segment::BoxCorners<2>> out;
  for (const std::string& box : a.boxes) {
    const auto corners = split_box("--box", box, 2);
    out.push_back({parse_plane_point("--box", corners[0], a.space, image),
                   parse_plane_point("--box", corners[1], a.space, image)});
  }
  return out;
}

}  // namespace surfseg::curve_program
