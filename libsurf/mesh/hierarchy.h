// The shells of a surface: which lies in which, which are phantoms, which to keep (thesis 4.3,
// Algs. 12 to 16, in space).
//
// Everywhere: a closed, consistently oriented surface whose components are 2-manifolds and neither
// intersect nor touch. The domain is where the surface's winding number is at least one.
#pragma once

#include <string>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/mesh/nesting.h"

namespace surf::mesh {

/// One edge-connected component.
struct Shell : Nesting {
  int n_triangles = 0;
  double volume_mm3 = 0;  ///< enclosed by this shell alone, negative if its normals point inward
  double area_mm2 = 0;
  Vector<3> center_ras_mm = Vector<3>::Zero();  ///< centroid of the area
  int genus = 0;
};

struct ShellHierarchy {
  std::vector<Shell> shells;     ///< in the order of their first triangles
  std::vector<int> of_triangle;  ///< shell of each triangle
};

/// Algs. 12 and 13. Containment by the exact signed crossings of one ray per shell, O(n log n) for
/// n triangles in place of O(n) for each shell.
ShellHierarchy shell_hierarchy(const Triangles& surface);

/// A connected part of the domain: a real outward shell and the real shells directly in it.
struct Solid {
  int outer = 0;              ///< shell
  std::vector<int> cavities;  ///< shells, ascending
  double volume_mm3 = 0;      ///< without the cavities
  double area_mm2 = 0;        ///< with the cavities' walls
};

/// All parts of the domain, in the order of their outer shells. Phantoms are passed over.
std::vector<Solid> solids(const ShellHierarchy& hierarchy);

enum class Keep {
  kAll,
  kLargest,  ///< the solid of the largest volume, the first of equal ones
  kSeeded    ///< solids that contain a seed; a seed in a cavity is not contained
};

/// What stays of a surface; phantoms never do.
struct SolidFilter {
  bool fill_cavities = false;  ///< first: cavities go, with all that lies in them
  double min_volume_mm3 = 0;   ///< then solids of less, with their cavities
  Keep keep = Keep::kAll;      ///< then all but these, with their cavities
  Points<3> seeds_ras_mm;      ///< (n, 3), for kSeeded

  /// Empty if valid, else field, value and constraint.
  std::string error() const;
};

/// A solid, a cavity or a phantom that was removed.
struct Removal {
  enum class Reason {
    kPhantom,     ///< not a boundary of the domain
    kFilled,      ///< a cavity that was filled
    kSwallowed,   ///< a solid in a cavity that was filled
    kSmall,       ///< a solid below the least volume
    kNotLargest,  ///< a solid, see Keep
    kNotSeeded
  };
  Reason reason = Reason::kPhantom;
  int n_shells = 1;                             ///< with the cavities that went with a solid
  double volume_mm3 = 0;                        ///< of these shells, signed: negative for a cavity
  Vector<3> center_ras_mm = Vector<3>::Zero();  ///< of the outer shell's area
};

/// "phantom", "filled cavity", ..., in the plural unless n is 1.
std::string to_string(Removal::Reason reason, int n = 1);

struct FilteredSurface {
  /// The triangles that stay in their order, points and their order bit for bit; points that no
  /// triangle uses are dropped.
  Triangles surface;
  std::vector<Removal> removed;
};

/// Phantoms leave, so that the rest is the boundary of the domain, and what else the filter rules
/// out. Algs. 14 to 16 also remove everything in a phantom; here a shell inside stays if it bounds
/// the domain. May leave nothing.
/// @throws UsageError  filter.error() is not empty
FilteredSurface filtered(const Triangles& surface, const SolidFilter& filter = {});

}  // namespace surf::mesh
