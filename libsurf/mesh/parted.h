// What is left of a shape beside another one.
#pragma once

#include <functional>
#include <string>

#include "libsurf/base/types.h"

namespace surf::mesh {

template <int Dim>
struct PartOptions {
  /// Wanted gap [mm] between the two where they met, > 0. It comes to lie between a quarter of it
  /// and twice it.
  double gap_mm = 0;
  /// Pieces that the cut leaves and that enclose less [mm^Dim] go ...
  double min_content = 0;
  /// ... and those with less than this twice the content over the measure [mm].
  double min_thickness_mm = 0;
  /// The numbers of a file; everything is checked for what comes out of it. Empty = as it is.
  std::function<Simplices<Dim>(const Simplices<Dim>&)> rounded = {};

  std::string error() const;  ///< empty if valid
};

template <int Dim>
struct Parted {
  /// The same bytes as before where nothing overlapped. No element: nothing is left.
  Simplices<Dim> shape;
  bool has_changed = false;
  double removed = 0;  ///< of the content, crumbs included [mm^Dim]
  int n_crumbs = 0;    ///< pieces that were too small or too thin
  double crumbs = 0;   ///< [mm^Dim]
};

}  // namespace surf::mesh
