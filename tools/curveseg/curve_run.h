// What segment and stack share: the options of a run on an image, and its start.
#pragma once

#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"
#include "tools/common/run_arguments.h"

namespace surfseg::curve_program {

/// The options as they were typed.
struct CurveArguments : RunArguments {
  std::string space = "px";
  std::vector<std::string> circles;
  std::string contour, seeds_grid, landmarks;
  std::string sampling = "spline";
  bool dark = false;

  bool has_initial() const {
    return !circles.empty() || !contour.empty() || !seeds_grid.empty() || !landmarks.empty();
  }
};

void add_curve_options(CLI::App& command, CurveArguments& a);

/// What can be found wrong before the image is known.
/// @throws surf::UsageError
void check_curve_arguments(const CLI::App& command, const CurveArguments& a);

/// @throws surf::UsageError  -o is missing, or is no name of a file of contours
void check_contour_output(const std::string& output);

/// What is given and does nothing, see tools/common/idle_options.h.
std::vector<std::string> idle_curve_options(const CLI::App& command, const CurveArguments& a);

/// Seeds, initial curves and everything else for one image.
/// @throws surf::UsageError, surf::InputError
surf::curve::CurveOptions curve_options(const CLI::App& command, const CurveArguments& a,
                                        const surf::curve::Image& image);

/// Of --box.
std::vector<surf::segment::BoxCorners<2>> boxes_mm(const CurveArguments& a,
                                                   const surf::curve::Image& image);

}  // namespace surfseg::curve_program
