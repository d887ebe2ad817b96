// Measures of a triangle surface: size, topology, shape of its triangles.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// Sum of the triangles' areas [mm^2].
double area_mm2(const Triangles& surface);

/// Volume enclosed by a closed surface [mm^3], by the divergence theorem: positive if its
/// normals point outward; cavities count negative. Meaningless if open.
double volume_mm3(const Triangles& surface);

/// Centre of mass of the enclosed volume [mm, RAS]; of the area if the volume is zero or the
/// surface is open.
Vector<3> centroid(const Triangles& surface);

/// One edge-connected part of a surface.
struct ComponentMeasures {
  int n_vertices = 0;  ///< that its triangles use
  int n_edges = 0;
  int n_triangles = 0;
  int n_border_edges = 0;  ///< edges of one triangle only
  double area_mm2 = 0;
  double volume_mm3 = 0;
  Vector<3> area_centroid_mm = Vector<3>::Zero();  ///< RAS; lies among the triangles

  int euler_characteristic() const { return n_vertices - n_edges + n_triangles; }
  /// Handles of a closed orientable manifold: 0 for a sphere, 1 for a torus.
  int genus() const { return (2 - euler_characteristic()) / 2; }
};

/// Measures of each component, in the order of their first triangles.
std::vector<ComponentMeasures> measure_components(const Triangles& surface);

/// Shape of the triangles.
struct Quality {
  double min_angle_deg = 0;
  double max_angle_deg = 0;
  double share_above_25_deg = 0;  ///< of the triangles whose smallest angle is >= 25 degrees
  double min_edge_mm = 0, mean_edge_mm = 0, max_edge_mm = 0;
};

/// Zero everywhere for a surface without triangles. Degenerate triangles have an angle of 0.
Quality quality(const Triangles& surface);

/// The three angles [degrees] of a triangle; 0, 0, 180 or alike where it is degenerate.
Eigen::Vector3d angles_deg(const Vector<3>& a, const Vector<3>& b, const Vector<3>& c);

}  // namespace surf::mesh
