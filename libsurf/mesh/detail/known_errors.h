// Quadrature errors of the faces of a mesh that stay with them. Private to adapt().
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

/// The errors of fem::quadrature_error() for some integrands. A mesh that is mended in rounds keeps
/// most of its faces in each: those whose corners are where they were are not sampled again (a
/// sixth of the evolution of the inside of a skull before). The mesh holds them as properties.
class KnownErrors {
 public:
  using Integrands = std::vector<std::shared_ptr<const Field<3>>>;

  KnownErrors(TriMesh& mesh, const Integrands& integrands);

  /// Of all faces, or of those that are named, (m, integrands).
  /// @param shape  element n is face n, or faces[n]
  Eigen::MatrixXd operator()(const fem::Geometry<3>& shape, std::span<const int> faces = {});

 private:
  TriMesh& mesh_;
  const Integrands& integrands_;
};

}  // namespace surf::mesh
