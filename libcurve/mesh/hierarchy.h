// The components of a set of curves: which lies in which, which are phantoms (thesis Algs. 12 to
// 16).
#pragma once

#include <optional>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::curve {

/// One closed polygon.
struct Component {
  int n_elements = 0;
  int first_element = 0;
  double area_mm2 = 0;  ///< signed (4.1): negative for a clockwise polygon, such as a hole
  double length_mm = 0;
  Vector<2> centre = Vector<2>::Zero();  ///< of the length [mm]
  bool is_outward = true;                ///< counter-clockwise: the sign of the exact area
  int depth = 0;                         ///< number of components that enclose it
  std::optional<int> parent;             ///< the innermost of them
  /// Winding number of all curves just outside the normal's side, and behind, where it is one more.
  int winding_before = 0;
  int winding_behind() const { return winding_before + 1; }

  /// It bounds the domain: 0 before it, 1 behind. All others are phantoms.
  bool is_real() const { return winding_before == 0; }
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
/// others stay in their order, bit for bit.
Segments kept(const Segments& curves, const CurveHierarchy& hierarchy,
              const std::vector<char>& keep);

/// Algs. 14 to 16: without the phantoms. Unlike there, what lies in a phantom and bounds the domain
/// stays.
Segments without_phantoms(const Segments& curves);

}  // namespace surf::curve
