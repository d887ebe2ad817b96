// Curves to SVG, GeoJSON-like JSON, VTP and CSV files, and back from JSON and CSV.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"
#include "libsurf/io/space.h"

namespace surf::curve {

/// True if `path` ends like a contour file that can be written: .svg, .json, .vtp, .csv.
bool is_writable_contour(const std::string& path);

/// Writes the curves in an image's plane by the ending of `path`, whole or not at all:
///  - .json: a FeatureCollection with one Polygon per connected part of the domain, its holes as
///    further rings, in plane mm; the matrices from pixels to mm and, for a slice, from mm
///    to RAS and its thickness beside it;
///  - .csv: polygon, ring (0 is the outer one), x_mm, y_mm;
///  - .svg: in pixels from the image's top left corner, to be laid over the image;
///  - .vtp: closed lines, of a slice in the world and in `space`, else x_mm, y_mm, 0.
/// Coordinates keep all their digits.
/// @param curves  simple and alternating (verify.h)
/// @throws UsageError, OutputError
void write_contours(const std::string& path, const Segments& curves, const Image& image,
                    io::Space space = io::Space::kLps);

/// The curves of one slice of a stack.
struct SliceContours {
  int slice = 0;
  Segments curves;
  Eigen::Affine3d plane_to_ras;
};

/// Writes a stack of contours in the world [mm, in `space`] to .json, .csv or .vtp: as above with
/// three coordinates and the slice's number.
/// @throws UsageError, OutputError
void write_stack(const std::string& path, const std::vector<SliceContours>& stack,
                 io::Space space = io::Space::kLps);

/// True if `path` ends like a contour file that can be read: .json, .csv.
bool is_readable_contour(const std::string& path);

/// Reads curves in plane mm from a .json or .csv file of the forms above; a JSON file may also be
/// one Polygon or MultiPolygon. Rings are turned so that the domain lies on their left.
/// @throws InputError  unreadable, not of such a form, a ring of fewer than three points, no ring
Segments read_contours(const std::string& path);

/// The pixels of the image that the curves were found in.
struct ContourPixels {
  std::array<int, 2> size;
  Eigen::Affine2d to_plane;
  std::optional<Eigen::Affine3d> plane_to_ras;  ///< of a slice: Image::plane_to_ras()
  double thickness_mm = 0;                      ///< of a slice; 0 = unknown
};
/// As a .json file of the form above states them; nothing if it does not.
/// @throws InputError  unreadable, a matrix that is singular or not finite, a slice's place or
///                     thickness of another form
std::optional<ContourPixels> pixels_of_contours(const std::string& path);

}  // namespace surf::curve
