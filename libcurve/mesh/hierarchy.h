// The components of a set of curves: which lies in which, which are phantoms (thesis Algs. 12 to
// 16).
#pragma once

#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/mesh/nesting.h"

namespace surf::curve {

/// One closed polygon; outward is counter-clockwise.
struct Component : mesh::Nesting {
  int n_elements = 0;
  int first_element = 0;
  double area_mm2 = 0;  ///< signed (4.1): negative for a clockwise polygon, such as a hole
  double length_mm = 0;
  Vector<2> centre = Vector<2>::Zero();  ///< of the length [mm]
};

struct CurveHierarchy {
  std::vector<Component> components;  ///< in the order of their first elements
  std::vector<int> of_element;        ///< component of each element
};

/// Algs. 12 and 13 of curves that neither intersect nor touch. Containment by one exact ray per
/// component along a grid of columns, in place of the O(kn) of Alg. 13.
/// @throws InvalidMesh  a node does not start and end exactly one element
CurveHierarchy curve_hierarchy(const Segments& curves);

/// A connected part of the domain: a real outward component and the real holes directly in it.
struct Region {
  int outer = 0;           ///< component
  std::vector<int> holes;  ///< components, ascending
  double area_mm2 = 0;     ///< without the holes
  double length_mm = 0;    ///< with the holes' boundaries
};

/// All parts of the domain, in the order of their outer components; phantoms are passed over.
std::vector<Region> regions(const CurveHierarchy& hierarchy);

/// The components that are flagged, one flag each; points that no element uses are dropped, the
/// others stay in their order, bit for bit. Flags of the real ones leave the phantoms out; Algs. 14
/// to 16 also remove what lies in a phantom and bounds the domain.
Segments kept(const Segments& curves, const CurveHierarchy& hierarchy,
              const std::vector<char>& keep);

/// The curves as contour files give them back: ring after ring, each from its first element on,
/// holes after the outer ring of their region. What bounds no region comes last.
/// @throws InvalidMesh  as curve_hierarchy()
Segments in_file_order(const Segments& curves);

}  // namespace surf::curve
