// Where an evolution starts if not from balls round the seeds: bodies, and what is asked of a
// surface.
#pragma once

#include <Eigen/Dense>
#include <optional>

#include "libsurf/base/types.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

struct InitialSurface {
  Triangles surface;                             ///< RAS mm
  std::optional<Eigen::Vector3d> center_ras_mm;  ///< of a body: inside it
};

/// Bodies with edges no longer than edge_length_mm, and shorter where the body is small: half of
/// its least radius or side.
/// @throws UsageError  as mesh::ball(), ellipsoid() and box()
InitialSurface initial_ball(const Eigen::Vector3d& center, double radius_mm, double edge_length_mm);
/// @param axes  columns are the semi-axes [mm]
InitialSurface initial_ellipsoid(const Eigen::Vector3d& center, const Eigen::Matrix3d& axes,
                                 double edge_length_mm);
/// The parallelepiped with sides along `axes` and two opposite corners a and b.
/// @param axes  columns are unit vectors, of any handedness
InitialSurface initial_box(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                           const Eigen::Matrix3d& axes, double edge_length_mm);
/// The ellipsoid next to points on the object, mesh/fit_ellipsoid.h.
InitialSurface fitted_ellipsoid(const Points<3>& points_ras_mm, double edge_length_mm);

/// Unit vectors in RAS along the indices of a volume.
Eigen::Matrix3d voxel_axes(const volume::Volume& volume);

/// @throws InputError  the surface is not closed, manifold, outward and free of
///                     self-intersections, or nothing of what it encloses lies in the volume
void check_initial(const Triangles& surface, const volume::Volume& volume);

}  // namespace surf::segment
