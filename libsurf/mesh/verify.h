// The final check of a surface: closed, 2-manifold, outward, without self-intersections.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

/// What was found. Lists hold the first offenders only, at most kMaxListed, ascending.
struct Verification {
  static constexpr std::size_t kMaxListed = 10;

  bool closed = false;    ///< at least one triangle, no border edge
  bool manifold = false;  ///< edges of at most two triangles, vertices with one fan
  /// Closed, neighbours consistently oriented, and every component's normals point out of the
  /// solid: away from the inside of an outer shell, into a cavity. Shells nest: one that lies
  /// in an odd number of others bounds a cavity.
  bool outward = false;

  int n_triangles = 0;
  int n_components = 0;  ///< joined by edges
  int n_border_edges = 0;
  int n_nonmanifold_edges = 0;     ///< of three and more triangles, and from a vertex to itself
  int n_nonmanifold_vertices = 0;  ///< where fans touch that no edge joins
  int n_misoriented_edges = 0;     ///< both triangles run along them the same way
  int n_unbalanced_edges = 0;      ///< non-manifold ones that more triangles run along one way
  int n_inverted_components = 0;   ///< of a solid: normals point the wrong way
  int n_degenerate = 0;            ///< triangles with collinear corners, exactly
  int n_self_intersections = 0;    ///< pairs, see self_intersections.h
  int n_invalid = 0;               ///< triangles with a missing or non-finite point; if any, the
                                   ///< geometric checks are not made and count 0
  double min_angle_deg = 0;

  std::vector<std::pair<int, int>> border_edges;  ///< vertices
  std::vector<std::pair<int, int>> nonmanifold_edges;
  std::vector<int> nonmanifold_vertices;
  std::vector<int> degenerate;
  std::vector<std::pair<int, int>> self_intersections;  ///< triangles

  /// Encloses a volume, if only piece by piece: closed, and as many triangles run along each edge
  /// one way as the other.
  bool is_solid() const { return closed && n_misoriented_edges == 0 && n_unbalanced_edges == 0; }
  /// Every guarantee holds.
  bool passed() const;
  /// One sentence: "closed, manifold, outward, no self-intersection; 1 component, ...", or
  /// what is wrong and where: "3 border edges (first: vertices 4 and 7), ...".
  std::string message() const;
};

/// Checks any soup of triangles, exactly (indices, and exact predicates on the coordinates). O(n
/// log n).
Verification verify(const Triangles& surface);

}  // namespace surf::mesh
