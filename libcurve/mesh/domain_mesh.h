// Triangulations of the plane inside and outside curves.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// Corners of triangles, counter-clockwise: (m, 3).
using PlaneTriangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

struct DomainMesh;

/// How long the edges of a domain mesh may be [mm]: a bound everywhere, and bounds on the cells of
/// a grid, which data-driven adaptivity (Alg. 8) lowers and raises again.
class SizeField {
 public:
  /// @param outer    points whose bounding box the grid covers, (n, 2)
  /// @param max_size  bound everywhere, > 0
  /// @param cell     side of the grid's cells, > 0
  SizeField(const Points<2>& outer, double max_size, double cell);

  double max_size() const { return max_size_; }
  double at(const Vector<2>& x) const { return sizes_[index(x)]; }
  /// Lowers the bound of the cell round x.
  /// @param error  what the indicator is with the present bound, per area: what raising it costs
  void limit(const Vector<2>& x, double size, double error = 0);
  /// Gives cells the bound back that they had before the last one: those that no triangle to be
  /// held touches, cheapest first, as long as their costs together are within the budget.
  /// @param is_held  per triangle of the mesh
  /// @return         how many cells
  int raise(const DomainMesh& mesh, const std::vector<char>& is_held, double budget);

 private:
  struct Bound {
    double size, error;
  };

  Eigen::Array2i cell_of(const Vector<2>& x) const;
  std::size_t index(const Vector<2>& x) const;
  std::vector<char> touched(const DomainMesh& mesh, const std::vector<char>& triangles) const;

  Vector<2> lower_;
  double max_size_, cell_;
  Eigen::Vector2i n_;
  std::vector<double> sizes_;
  std::vector<std::vector<Bound>> before_;  // of each cell: what it has been lowered from
};

/// A part of a curve's element that is an edge of the mesh.
struct TraceEdge {
  int start = 0, end = 0;         ///< nodes, the domain inside the curves on the left
  int element = 0;                ///< of the curves
  double from = 0, to = 1;        ///< where on it: 0 at its first vertex, 1 at its second
  int inside = -1, outside = -1;  ///< triangles
};

/// A conforming Delaunay triangulation of a box cut by curves. Both domains in one mesh: Omega_1 is
/// inside the curves, Omega_2 outside.
struct DomainMesh {
  Points<2> points;                ///< (n, 2) [mm]; the first ones are the vertices of the curves
  PlaneTriangles triangles;        ///< (m, 3)
  std::vector<char> is_inside;     ///< per triangle
  std::vector<char> is_on_border;  ///< per node: of the box
  std::vector<TraceEdge> trace;    ///< all of every element, element by element, from start to end
};

/// Delaunay refinement by CGAL: edges obey the sizes, angles are at least 20.7 degrees but where
/// curves have smaller ones. Elements of the curves may be split.
/// @param curves  simple, oriented so that the domain is on the left, strictly inside `outer`
/// @param outer   corners of the box, convex, counter-clockwise, (k, 2)
/// @param kept    nodes to begin with, such as those of an earlier mesh; none on the curves
/// @throws InvalidMesh  curves meet one another or the box
DomainMesh mesh_domain(const Segments& curves, const Points<2>& outer, const SizeField& sizes,
                       const Points<2>& kept = {});

/// The inner nodes of a mesh that suit new curves: not too close to them, and not so close together
/// that they only tell where the curves once were.
Points<2> reusable_nodes(const DomainMesh& mesh, const Segments& curves, const SizeField& sizes);

/// Finds the triangle of a mesh that contains a point.
class TriangleFinder {
 public:
  /// @param mesh  must outlive this object
  explicit TriangleFinder(const DomainMesh& mesh);

  struct Place {
    int triangle;
    Eigen::Vector3d barycentric;
  };
  /// The first triangle that contains x, up to rounding; of a point outside the box, the nearest of
  /// those whose boxes lie round its place on the grid, or of all if there are none.
  Place operator()(const Vector<2>& x) const;

 private:
  Eigen::Array2i cell_of(const Vector<2>& x) const;
  Place among(const std::vector<int>& triangles, const Vector<2>& x) const;

  const DomainMesh& mesh_;
  Vector<2> lower_;
  double cell_;
  Eigen::Array2i n_;
  std::vector<std::vector<int>> in_cell_;  // triangles whose boxes meet it
};

/// Smallest angle of the triangles [degrees].
double smallest_angle(const DomainMesh& mesh);

}  // namespace surf::curve
