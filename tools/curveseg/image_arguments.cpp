#include "tools/curveseg/image_arguments.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <cmath>
#include <optional>

#include "libcurve/image/read_image.h"
#include "libsurf/base/error.h"
#include "libsurf/volume/read_volume.h"
#include "tools/common/arguments.h"
#include "tools/common/option_group.h"

namespace surfseg::curve_program {
namespace {

using surf::UsageError;
using surf::curve::BetweenVoxels;
using surf::curve::SlicePlane;

struct SliceChoice {
  SlicePlane plane;
  int index;
};

SliceChoice parse_slice(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos)
    throw UsageError(fmt::format(
        "--slice: expected PLANE:INDEX, such as axial:120, sagittal:60 or coronal:80; got '{}'",
        text));
  const double index = parse_number("--slice", text.substr(colon + 1));
  if (index != int(index))
    throw UsageError(fmt::format("--slice: expected a whole number after ':'; got '{}'", text));
  return {parse_slice_plane("--slice", text.substr(0, colon)), int(index)};
}

struct PlaneChoice {
  Eigen::Vector3d point, normal;
};

PlaneChoice parse_plane(const std::string& text) {
  const auto n = parse_numbers("--plane", text, 6, "a point and a normal X,Y,Z,NX,NY,NZ in RAS mm");
  PlaneChoice out{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (!(out.normal.norm() > 0)) throw UsageError("--plane: the normal is 0");
  return out;
}

std::optional<Eigen::Vector2d> parse_spacing(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const bool is_single = text.find(',') == std::string::npos;
  const auto n = parse_numbers("--spacing", is_single ? text + "," + text : text, 2,
                               "one or two lengths in mm, such as 0.5 or 0.5,0.7");
  if (!(n[0] > 0 && n[1] > 0))
    throw UsageError(fmt::format("--spacing: a spacing must be positive; got '{}'", text));
  return Eigen::Vector2d(n[0], n[1]);
}

/// A point given in the world belongs to the slice, not to another one that it would be seen in.
void check_is_in_slice(const std::string& option, const std::string& text,
                       const Eigen::Vector3d& in_plane, const std::string& space,
                       const surf::curve::Image& image) {
  constexpr double kRounding = 1e-3;  // of the thickness: points are typed with few digits
  const double away = std::abs(in_plane[2]), half = image.thickness_mm() / 2;
  if (half == 0 || away <= (1 + kRounding) * half) return;
  Eigen::Vector3d next = *image.plane_to_ras() * Eigen::Vector3d(in_plane[0], in_plane[1], 0);
  if (space == "lps") next.head<2>() *= -1;
  throw UsageError(fmt::format(
      "{}: {} lies {:.4g} mm off the plane of the slice ({}; {:.4g} mm thick), whose next point is "
      "{:.6g},{:.6g},{:.6g} {}; choose another slice or point",
      option, text, away, image.source().format, image.thickness_mm(), next[0], next[1], next[2],
      space));
}

}  // namespace

SlicePlane parse_slice_plane(const std::string& option, const std::string& text) {
  if (text == "axial") return SlicePlane::kAxial;
  if (text == "sagittal") return SlicePlane::kSagittal;
  if (text == "coronal") return SlicePlane::kCoronal;
  throw UsageError(fmt::format("{}: expected axial, sagittal or coronal; got '{}'", option, text));
}

void ImageArguments::check() const {
  if (path.empty()) throw UsageError("IMAGE: an image is missing");
  if (!slice.empty() && !plane.empty()) throw UsageError("--slice, --plane: give one of them");
  if (!slice.empty()) parse_slice(slice);
  if (!plane.empty()) parse_plane(plane);
  const auto spacing_mm = parse_spacing(spacing);
  if (spacing_mm && !plane.empty() && (*spacing_mm)[0] != (*spacing_mm)[1])
    throw UsageError(fmt::format(
        "--spacing: pixels of a --plane are square; expected one length; got '{}'", spacing));
  which.check();
  if (page < 0) throw UsageError(fmt::format("--page: expected 0 or more; got {}", page));
  if (page > 0 && !(slice.empty() && plane.empty()))
    throw UsageError("--page: is of TIFF files; --slice and --plane are of volumes");
}

surf::curve::Image ImageArguments::read() const {
  check();
  const auto spacing_mm = parse_spacing(spacing);
  if (slice.empty() && plane.empty()) {
    if (surf::curve::is_image_file(path)) {
      if (which.frame_index > 0)
        throw UsageError(fmt::format(
            "--frame-index: {} is an image, not a 4-D volume; --page names a TIFF file's page",
            path));
      which.check_unused(path, "is an image");
      return surf::curve::read_image(path, {.spacing_mm = spacing_mm, .page = page});
    }
    // A volume is known by its own reader, whose message is the better one where it begins as one.
    try {
      which.read(path);
    } catch (const surf::volume::NotAVolume&) {
      throw surf::InputError(path + ": neither an image (PNG, JPEG, TIFF) nor a volume");
    }
    throw UsageError(fmt::format(
        "{}: is a volume; choose a slice, such as --slice axial:20, or a --plane", path));
  }
  if (surf::curve::is_image_file(path))
    throw UsageError(fmt::format("--slice, --plane: {} is an image, not a volume", path));
  const auto volume = which.read(path);
  if (!slice.empty()) {
    if (spacing_mm)
      throw UsageError(
          "--spacing: a slice has that of its volume; it belongs to images and --plane");
    const SliceChoice choice = parse_slice(slice);
    return surf::curve::VoxelSlices(volume, choice.plane).slice(choice.index);
  }
  const PlaneChoice choice = parse_plane(plane);
  return surf::curve::oblique_slice(
      volume, choice.point, choice.normal,
      spacing_mm ? std::optional<double>((*spacing_mm)[0]) : std::nullopt,
      are_labels ? BetweenVoxels::kNearest : BetweenVoxels::kLinear);
}

void add_image_arguments(CLI::App& command, ImageArguments& a) {
  command.add_option(
      "IMAGE", a.path,
      "PNG, JPEG or TIFF image; or, with --slice or --plane, any volume that surfseg "
      "reads");
  add_image_choice(command, a);
}

void add_image_choice(CLI::App& command, ImageArguments& a) {
  const OptionGroup group(command, "Which image");
  group.add("--spacing", a.spacing, "Pixel size in mm, S or SX,SY [what the file states, else 1]");
  group.add_with_default("--page", a.page, "Page of a TIFF file, from 0");
  group.add("--slice", a.slice,
            "Slice of a volume by its voxel index: axial:120, sagittal:60, coronal:80");
  group.add("--plane", a.plane,
            "Oblique plane through a volume: point and normal X,Y,Z,NX,NY,NZ, RAS mm");
  a.which.add_to(command, group.name());
}

Eigen::Vector2d parse_plane_point(const std::string& option, const std::string& text,
                                  const std::string& space, const surf::curve::Image& image) {
  if (space == "px" || space == "mm") {
    const auto n = parse_numbers(option, text, 2, "two numbers X,Y");
    const Eigen::Vector2d point(n[0], n[1]);
    return space == "px" ? image.pixel_to_plane() * point : point;
  }
  if (!image.plane_to_ras())
    throw UsageError(
        fmt::format("--space {}: the image is no slice of a volume; use px or mm", space));
  const Eigen::Vector3d point = parse_point(option, text);
  const Eigen::Vector3d ras =
      to_ras_mm(point, space == "lps" ? Space::kLps : Space::kRas, Eigen::Affine3d::Identity());
  const Eigen::Vector3d in_plane = image.plane_to_ras()->inverse() * ras;
  check_is_in_slice(option, text, in_plane, space, image);
  return in_plane.head<2>();
}

std::optional<SlicePlace> place_of(const surf::curve::Image& image) {
  if (!image.plane_to_ras()) return std::nullopt;
  return SlicePlace{fmt::format("{} ({})", image.source().path, image.source().format),
                    *image.plane_to_ras(), image.thickness_mm()};
}

std::optional<SlicePlace> place_of(const std::string& contours,
                                   const std::optional<surf::curve::ContourPixels>& pixels) {
  if (!pixels || !pixels->plane_to_ras) return std::nullopt;
  const double pixel_mm = std::sqrt(std::abs(pixels->to_plane.linear().determinant()));
  return SlicePlace{contours, *pixels->plane_to_ras,
                    pixels->thickness_mm > 0 ? pixels->thickness_mm : pixel_mm};
}

surf::Segments in_plane(const surf::Segments& curves, const std::optional<SlicePlace>& from,
                        const std::optional<SlicePlace>& to) {
  constexpr double kRounding = 1e-3;   // of the thickness: matrices of files are 32-bit floats
  constexpr double kMostTilt_deg = 8;  // lengths shrink by a hundredth
  if (!from || !to) return curves;
  const auto offset = surf::curve::plane_offset(curves, from->plane_to_ras, to->plane_to_ras);
  if (offset.most_mm > (1 + kRounding) * to->thickness_mm / 2 || offset.angle_deg > kMostTilt_deg)
    throw surf::InputError(fmt::format(
        "{} lies in another plane than {}: up to {:.4g} mm off, {:.1f} degrees tilted; expected at "
        "most {:.4g} mm, half the slice's thickness, and {} degrees; choose another slice",
        from->name, to->name, offset.most_mm, offset.angle_deg, to->thickness_mm / 2,
        kMostTilt_deg));
  return surf::curve::carried(curves, from->plane_to_ras, to->plane_to_ras);
}

}  // namespace surfseg::curve_program
