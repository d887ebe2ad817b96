// How a domain mesh follows its curves.
#pragma once

#include <vector>

#include "libcurve/mesh/domain_mesh.h"

namespace surf::curve {

/// The linear map from displacements of the curves' vertices to those of all nodes: linear along
/// the elements, harmonic on the nodes within some rings of triangles round them (P1, 0 beyond).
/// So an energy of a mesh has an exact derivative with respect to the curves.
class MeshMotion {
 public:
  /// @param mesh        must outlive this object
  /// @param n_vertices  of the curves
  MeshMotion(const DomainMesh& mesh, const Elements<2>& elements, Eigen::Index n_vertices,
             int n_rings = 5);

  /// The nodes when the vertices are displaced: (n, 2).
  Points<2> moved(const Points<2>& displacement) const;
  /// The nodes on the curves and those that follow them: what transposed() looks at, a flag each.
  std::vector<char> moving() const;
  /// The transposed map: the derivative by the curves' vertices from that by the nodes.
  Points<2> transposed(const Points<2>& of_nodes) const;

 private:
  struct Share {
    int node, vertex;
    double weight;
  };
  Points<2> solved(const Points<2>& rhs) const;

  const DomainMesh& mesh_;
  Eigen::Index n_vertices_;
  std::vector<Share> shares_;      // of trace nodes
  std::vector<int> mobile_;        // nodes that follow
  SparseMatrix inner_, coupling_;  // (mobile, mobile), (mobile, nodes)
  Eigen::VectorXd inverse_diagonal_;
};

}  // namespace surf::curve
