#include "libsurf/mesh/detail/corefined.h"

#include <CGAL/Polygon_mesh_processing/corefinement.h>

#include <array>

#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

namespace Pmp = CGAL::Polygon_mesh_processing;

/// One call for both, which only differ in the place of `out`: its templates take a minute.
bool corefined(CutMesh& first, CutMesh& second, Pmp::Corefinement::Boolean_operation_type kind,
               CutMesh& out) {
  std::array<boost::optional<CutMesh*>, 4> outputs;
  outputs[kind] = &out;
  try {
    return Pmp::corefine_and_compute_boolean_operations(
        first, second, outputs, CGAL::parameters::throw_on_self_intersection(true))[kind];
  } catch (const Pmp::Corefinement::Self_intersection_exception& error) {
    throw InvalidMesh(error.what());
  }
}

}  // namespace

bool intersect(CutMesh& first, CutMesh& second, CutMesh& out) {
  return corefined(first, second, Pmp::Corefinement::INTERSECTION, out);
}

bool subtract(CutMesh& first, CutMesh& second, CutMesh& out) {
  return corefined(first, second, Pmp::Corefinement::TM1_MINUS_TM2, out);
}

}  // namespace surf::mesh
