// Solids cut by one another with CGAL, whose templates are compiled here alone.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

namespace surf::mesh {

using CutKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using CutMesh = CGAL::Surface_mesh<CutKernel::Point_3>;

/// Writes what two solids share, or what the second one leaves of the first; both meshes change.
/// @param out  may be the first mesh
/// @return     whether it is manifold; if not, `out` says nothing
/// @throws InvalidMesh  a mesh intersects itself where they meet
bool intersect(CutMesh& first, CutMesh& second, CutMesh& out);
bool subtract(CutMesh& first, CutMesh& second, CutMesh& out);

}  // namespace surf::mesh
