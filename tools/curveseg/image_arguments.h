// Which image: a file, or a slice of a volume; points and contours in it.
#pragma once

#include <optional>
#include <string>

#include "libcurve/image/image.h"
#include "libcurve/image/slice.h"
#include "libcurve/io/contour_file.h"
#include "tools/common/cli_app.h"
#include "tools/common/volume_arguments.h"

namespace surfseg::curve_program {

/// The options as they were typed.
struct ImageArguments {
  std::string path, spacing, slice, plane;
  VolumeArguments which;
  int page = 0;
  bool are_labels = false;  ///< not typed: pixels of --plane have the label of the nearest voxel

  /// What can be found wrong before the file is read.
  /// @throws surf::UsageError
  void check() const;
  /// @throws surf::UsageError, surf::InputError
  surf::curve::Image read() const;
};

/// Adds IMAGE and how to read it.
void add_image_arguments(CLI::App& command, ImageArguments& a);
/// The latter alone.
void add_image_choice(CLI::App& command, ImageArguments& a);

/// "axial", ...
/// @throws surf::UsageError
surf::curve::SlicePlane parse_slice_plane(const std::string& option, const std::string& text);

/// A point of an image's plane [mm] from "X,Y" in px or mm, or, of a slice, "X,Y,Z" in ras or lps,
/// which is projected along the plane's normal.
/// @throws surf::UsageError  malformed, or farther than half the slice's thickness from its plane
Eigen::Vector2d parse_plane_point(const std::string& option, const std::string& text,
                                  const std::string& space, const surf::curve::Image& image);

/// The plane of a slice in the world.
struct SlicePlace {
  std::string name;  ///< for messages
  Eigen::Affine3d plane_to_ras;
  double thickness_mm;  ///< > 0
};

/// Of an image that is a slice.
std::optional<SlicePlace> place_of(const surf::curve::Image& image);
/// Of the slice that contours were found in, if their file states it. One that does not say how
/// thick it is is as thick as a pixel is wide.
std::optional<SlicePlace> place_of(const std::string& contours,
                                   const std::optional<surf::curve::ContourPixels>& pixels);

/// Contours of one slice in the plane of another one or on another grid, as they lie in the world;
/// as they are where one of the two has no place in it.
/// @throws surf::InputError  `to` is farther from them than half its thickness, or tilted
surf::Segments in_plane(const surf::Segments& curves, const std::optional<SlicePlace>& from,
                        const std::optional<SlicePlace>& to);

}  // namespace surfseg::curve_program
