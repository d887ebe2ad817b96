// Faces near events get edges of the resolution's size. Private to surgery.
#pragma once

#include <OpenMesh/Core/Utils/PropertyManager.hh>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/triangle_mesh.h"

namespace surf::mesh {

constexpr double kReach = 2;  // of a region along the surface, in units of the resolution

/// Alg. 11: bisects faces that are events, or nearer to one than a region reaches.
/// @param is_event  children inherit it
void refine_near_events(TriMesh& mesh, const OpenMesh::FProp<char>& is_event, double resolution_mm,
                        const BisectionHook& hook);

}  // namespace surf::mesh
