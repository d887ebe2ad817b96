#include "libsurf/segment/initial_surface.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/base/image_box.h"
#include "libsurf/mesh/clip.h"
#include "libsurf/mesh/fit_ellipsoid.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"

namespace surf::segment {

using Eigen::Matrix3d;
using Eigen::Vector3d;

InitialSurface initial_ball(const Vector3d& center, double radius_mm, double edge_length_mm) {
  return {mesh::ball(center, radius_mm, std::min(edge_length_mm, radius_mm / 2)), center};
}

InitialSurface initial_ellipsoid(const Vector3d& center, const Matrix3d& axes,
                                 double edge_length_mm) {
  const double least = axes.colwise().norm().minCoeff();
  return {mesh::ellipsoid(center, axes, std::min(edge_length_mm, least / 2)), center};
}

InitialSurface initial_box(const Vector3d& a, const Vector3d& b, const Matrix3d& axes,
                           double edge_length_mm) {
  const Matrix3d to_axes = axes.inverse();
  const Vector3d p = to_axes * a, q = to_axes * b;
  const double least = (p - q).cwiseAbs().minCoeff();
  InitialSurface out{mesh::box(p.cwiseMin(q), p.cwiseMax(q), std::min(edge_length_mm, least / 2)),
                     Vector3d((a + b) / 2)};
  out.surface.points = (out.surface.points * axes.transpose()).eval();
  if (axes.determinant() < 0) out.surface = mesh::flipped(std::move(out.surface));
  return out;
}

InitialSurface fitted_ellipsoid(const Points<3>& points_ras_mm, double edge_length_mm) {
  const auto fit = mesh::fit_ellipsoid<3>(points_ras_mm);
  return initial_ellipsoid(fit.center, fit.axes, edge_length_mm);
}

Matrix3d voxel_axes(const volume::Volume& volume) {
  return volume.index_to_world().linear().colwise().normalized();
}

void check_initial(const Triangles& surface, const volume::Volume& volume) {
  if (const mesh::Verification verification = mesh::verify(surface); !verification.passed())
    throw InputError("cannot start from this surface: " + verification.message());
  const ImageBox<3> box{volume.size(), volume.index_to_world(), volume.world_to_index()};
  for (const auto& point : surface.points.rowwise())
    if (box.contains(point.transpose())) return;
  // Large triangles may pass through the volume, or all of them round it.
  try {
    mesh::clipped(surface, box);
  } catch (const InvalidMesh& error) {
    throw InputError(
        fmt::format("cannot start from this surface: {}; is it in another space?", error.what()));
  }
}

}  // namespace surf::segment
