#include "tools/surfseg/initial_surface.h"

#include <fmt/format.h>

#include <array>
#include <sstream>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/io/read_landmarks.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/from_label_map.h"
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
  std::array<Vector3d, 2> corners = {point_at(kBox, parts, 0), point_at(kBox, parts, 3)};
  if ((corners[0] - corners[1]).cwiseAbs().minCoeff() == 0)
    throw surf::UsageError(
        fmt::format("{}: the corners must differ in all three numbers; got '{}'", kBox, text));
  return corners;
}

/// Unit vectors along the axes of the space, in RAS.
Matrix3d axes_of(Space space, const surf::volume::Volume& volume) {
  if (space == Space::kLps) return Vector3d(-1, -1, 1).asDiagonal();
  if (space == Space::kIjk) return surf::segment::voxel_axes(volume);
  return Matrix3d::Identity();
}

InitialSurface make_round(const Round& round, Space space, const surf::volume::Volume& volume,
                          double edge_length_mm) {
  const Vector3d center = to_ras_mm(round.center, space, volume.index_to_world());
  std::vector<double> radii_mm;
  for (const Length& radius : round.radii) radii_mm.push_back(radius.mm(volume.voxel_size()));
  if (radii_mm.size() == 1) return surf::segment::initial_ball(center, radii_mm[0], edge_length_mm);
  const Vector3d radii(radii_mm[0], radii_mm[1], radii_mm[2]);
  return surf::segment::initial_ellipsoid(center, axes_of(space, volume) * radii.asDiagonal(),
                                          edge_length_mm);
}

InitialSurface make_box(const std::array<Vector3d, 2>& corners, Space space,
                        const surf::volume::Volume& volume, double edge_length_mm) {
  return surf::segment::initial_box(to_ras_mm(corners[0], space, volume.index_to_world()),
                                    to_ras_mm(corners[1], space, volume.index_to_world()),
                                    axes_of(space, volume), edge_length_mm);
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
  return surf::segment::fitted_ellipsoid(points, edge_length_mm);
}

surf::Triangles read(const InitialArguments& arguments) {
  if (surf::io::is_readable_surface(arguments.file)) return surf::io::read_surface(arguments.file);
  return surf::mesh::surface_of_label_map(surf::volume::read_volume(arguments.file),
                                          arguments.label);
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
  try {
    surf::segment::check_initial(out.surface, volume);
  } catch (const surf::InputError& error) {
    throw surf::InputError(fmt::format("--initial: {}{}{}", arguments.file,
                                       arguments.file.empty() ? "" : ": ", error.what()));
  }
  return out;
}

}  // namespace surfseg
