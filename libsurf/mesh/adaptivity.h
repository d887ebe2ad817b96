// Space adaptivity of a surface, thesis 4.2: bisection where geometry or data want more elements,
// bisections undone where fewer do.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/fem/indicators.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

struct AdaptivityOptions {
  /// Alg. 6: epsilon_geom for the sum of h_S theta_S over a triangle's sides [mm]; 0 = not used.
  /// The thesis takes 0.02 where lengths are of order 1 (5.1).
  double geometry_tolerance_mm = 0;
  /// Alg. 7: epsilon_int per area of the surface, for each of the integrands; 0 = not used. The
  /// thesis takes 0.2 on surfaces of area 4 pi: 0.016.
  double integral_tolerance = 0;
  std::vector<std::shared_ptr<const Field<3>>> integrands = {};
  /// Alg. 8: epsilon_data per area, of the square of the interpolation error of each of the
  /// functions [their unit squared]; 0 = not used.
  double function_tolerance = 0;
  std::vector<std::shared_ptr<const Field<3>>> functions = {};
  double gamma_refine = 0.7;  ///< thesis 5.1
  /// In [0, gamma_refine); 0: nothing is coarsened. With the thesis' 0.3 a prism of 128^3 voxels
  /// needs 10 to 30 % more triangles for the same error.
  double gamma_coarsen = 0.65;

  /// Triangles with a longer edge are refined whatever the indicators say [mm], > 0.
  double max_length_mm = 0;
  /// Triangles without a longer edge are refined by the closure only [mm], 0 <= min_length_mm <=
  /// max_length_mm.
  double min_length_mm = 0;
  Eigen::Index max_elements = 2'000'000;

  std::string error() const;  ///< empty if valid
};

/// What the indicators and the limits on lengths say of each face: refine if any says so, coarsen
/// if all do.
std::vector<fem::Mark> adaptivity_marks(const fem::Geometry<3>& shape,
                                        const AdaptivityOptions& options);

struct AdaptivityReport {
  int n_rounds = 0;         ///< rounds that changed something
  int n_refined = 0;        ///< new vertices
  int n_coarsened = 0;      ///< removed vertices
  bool is_settled = false;  ///< the last round found nothing to change
  bool is_limited = false;  ///< max_elements kept something from being refined
  /// Faces still marked for coarsening after bisections were undone, one flag per face: what
  /// ImproveOptions::may_coarsen takes.
  std::vector<char> may_coarsen;
};

/// Marks, bisects marked faces up to d - 1 = 2 times, the second time where they are still marked
/// (by then their indicators have about halved), and undoes up to two bisections where all four
/// faces of a vertex are marked, until nothing changes or for max_rounds rounds.
///
/// Alg. 6 as printed can refine and coarsen for ever. Here a bisection is undone only if the two
/// faces that come back would not be marked for refinement: their h_S theta_S is computed, and the
/// error of a quadrature is taken to grow by 8 at most.
///
/// Vertices stay where they are and new ones stand at midpoints; the surface is changed by the
/// undone bisections alone, of which none turns a face by more than 60 degrees.
AdaptivityReport adapt(TriMesh& mesh, const AdaptivityOptions& options, int max_rounds = 30);

}  // namespace surf::mesh
