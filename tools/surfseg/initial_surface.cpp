#include "tools/surfseg/initial_surface.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <sstream>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/image_box.h"
#include "libsurf/io/read_landmarks.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/fit_ellipsoid.h"
#include "libsurf/mesh/from_label_map.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/volume/read_volume.h"

namespace surfseg {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr const char* kBall = "--initial-ball";
constexpr const char* kEllipsoid = "--initial-ellipsoid";
constexpr const char* kBox = "--initial-box";
constexpr const char* kLandmarks = "--landmarks";

std::vector<std::string> split(const std::string& option, const std::string& text, std::size_t n,
                               const char* form) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  if (parts.size() != n || text.ends_with(','))
    throw surf::UsageError(fmt::format("{}: expected {}; got '{}'", option, form, text));
  return parts;
}

Vector3d point_at(const std::string& option, const std::vector<std::string>& parts, int first) {
  return parse_point(option, parts[first] + "," + parts[first + 1] + "," + parts[first + 2]);
}

/// A point and one or three lengths: a ball or an ellipsoid.
struct Round {
  Vector3d center;
  std::vector<Length> radii;
};

Round parse_ball(const std::string& text) {
  const auto parts = split(kBall, text, 4, "X,Y,Z,RADIUS, such as 12,-30,44,10mm");
  return {point_at(kBall, parts, 0), {parse_positive_length(kBall, parts[3])}};
}

Round parse_ellipsoid(const std::string& text) {
  const auto parts = split(kEllipsoid, text, 6, "X,Y,Z,A,B,C, such as 12,-30,44,10mm,8mm,15mm");
  Round out{point_at(kEllipsoid, parts, 0), {}};
  for (int axis = 0; axis < 3; ++axis)
    out.radii.push_back(parse_positive_length(kEllipsoid, parts[3 + axis]));
  return out;
}

std::array<Vector3d, 2> parse_box(const std::string& text) {
  const auto parts = split(kBox, text, 6, "two corners X,Y,Z,X,Y,Z, such as 0,-40,20,25,-10,50");
  const std::array<Vector3d, 2> corners = {point_at(kBox, parts, 0), point_at(kBox, parts, 3)};
  if ((corners[0] - corners[1]).cwiseAbs().minCoeff() == 0)
    throw surf::UsageError(
        fmt::format("{}: the corners must differ in all three numbers; got '{}'", kBox, text));
  return corners;
}

/// Unit vectors along the axes of the space, in RAS.
Matrix3d axes_of(Space space, const surf::volume::Volume& volume) {
  if (space == Space::kLps) return Vector3d(-1, -1, 1).asDiagonal();
  if (space == Space::kIjk) return volume.index_to_world().linear().colwise().normalized();
  return Matrix3d::Identity();
}

InitialSurface make_round(const Round& round, Space space, const surf::volume::Volume& volume,
                          double edge_length_mm) {
  const Vector3d center = to_ras_mm(round.center, space, volume.index_to_world());
  std::vector<double> radii_mm;
  for (const Length& radius : round.radii) radii_mm.push_back(radius.mm(volume.voxel_size()));
  const double edge =
      std::min(edge_length_mm, *std::min_element(radii_mm.begin(), radii_mm.end()) / 2);
  if (radii_mm.size() == 1) return {surf::mesh::ball(center, radii_mm[0], edge), center};
  const Matrix3d axes =
      axes_of(space, volume) * Vector3d(radii_mm[0], radii_mm[1], radii_mm[2]).asDiagonal();
  return {surf::mesh::ellipsoid(center, axes, edge), center};
}

InitialSurface make_box(const std::array<Vector3d, 2>& corners, Space space,
                        const surf::volume::Volume& volume, double edge_length_mm) {
  const Matrix3d axes = axes_of(space, volume);
  const Matrix3d to_axes = axes.inverse();
  const Vector3d a = to_axes * to_ras_mm(corners[0], space, volume.index_to_world());
  const Vector3d b = to_axes * to_ras_mm(corners[1], space, volume.index_to_world());
  const Vector3d sides = (a - b).cwiseAbs();
  InitialSurface out{
      surf::mesh::box(a.cwiseMin(b), a.cwiseMax(b), std::min(edge_length_mm, sides.minCoeff() / 2)),
      Vector3d(axes * (a + b) / 2)};
  out.surface.points = (out.surface.points * axes.transpose()).eval();
  if (axes.determinant() < 0)  // mirrored voxels turn the triangles over
    out.surface.elements.col(1).swap(out.surface.elements.col(2));
  return out;
}

InitialSurface make_fitted(const std::string& path, Space space, const surf::volume::Volume& volume,
                           double edge_length_mm) {
  const surf::io::Landmarks landmarks = surf::io::read_landmarks(path);
  if (landmarks.points.cols() != 3)
    throw surf::InputError(fmt::format("{}: {}: expected three coordinates a line; got {}",
                                       kLandmarks, path, landmarks.points.cols()));
  surf::Points<3> points = landmarks.points;
  if (!landmarks.is_ras)
    for (auto point : points.rowwise())
      point = to_ras_mm(point.transpose(), space, volume.index_to_world()).transpose().eval();
  const auto fit = surf::mesh::fit_ellipsoid<3>(points);
  const double edge = std::min(edge_length_mm, fit.axes.colwise().norm().minCoeff() / 2);
  return {surf::mesh::ellipsoid(fit.center, fit.axes, edge), fit.center};
}

surf::Triangles read(const InitialArguments& arguments) {
  const surf::Triangles surface =
      surf::io::is_readable_surface(arguments.file)
          ? surf::io::read_surface(arguments.file)
          : surf::mesh::surface_of_label_map(surf::volume::read_volume(arguments.file),
                                             arguments.label);
  const surf::mesh::Verification verification = surf::mesh::verify(surface);
  if (!verification.passed())
    throw surf::InputError(fmt::format("--initial: {}: cannot start from this surface: {}",
                                       arguments.file, verification.message()));
  return surface;
}

void check_is_in_volume(const surf::Triangles& surface, const surf::volume::Volume& volume) {
  const surf::ImageBox<3> box{volume.size(), volume.index_to_world(), volume.world_to_index()};
  for (const auto& point : surface.points.rowwise())
    if (box.contains(point.transpose())) return;
  throw surf::InputError(
      "--initial: no vertex of the initial surface lies in the volume; is it in another space?");
}

}  // namespace

void InitialArguments::check() const {
  const int n = int(!file.empty()) + int(!ball.empty()) + int(!ellipsoid.empty()) +
                int(!box.empty()) + int(!landmarks.empty());
  if (n > 1)
    throw surf::UsageError(
        "--initial, --initial-ball, --initial-ellipsoid, --initial-box, --landmarks: give one of "
        "them");
  if (!ball.empty()) parse_ball(ball);
  if (!ellipsoid.empty()) parse_ellipsoid(ellipsoid);
  if (!box.empty()) parse_box(box);
}

InitialSurface make_initial_surface(const InitialArguments& arguments, Space space,
                                    const surf::volume::Volume& volume, double edge_length_mm) {
  arguments.check();
  InitialSurface out;
  if (!arguments.ball.empty())
    out = make_round(parse_ball(arguments.ball), space, volume, edge_length_mm);
  else if (!arguments.ellipsoid.empty())
    out = make_round(parse_ellipsoid(arguments.ellipsoid), space, volume, edge_length_mm);
  else if (!arguments.box.empty())
    out = make_box(parse_box(arguments.box), space, volume, edge_length_mm);
  else if (!arguments.landmarks.empty())
    out = make_fitted(arguments.landmarks, space, volume, edge_length_mm);
  else
    out.surface = read(arguments);
  check_is_in_volume(out.surface, volume);
  return out;
}

}  // namespace surfseg
