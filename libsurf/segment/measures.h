// What is worth knowing of a curve or surface.
#pragma once

#include <string>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::segment {

/// A connected part of the domain, or a cavity or hole in one.
template <int Dim>
struct Part {
  double content = 0;  ///< enclosed by its outer boundary alone [mm^Dim], >= 0
  double measure = 0;  ///< length or area of that boundary [mm^(Dim-1)]
  int genus = 0;       ///< of a surface
  Vector<Dim> center_mm = Vector<Dim>::Zero();  ///< of that boundary
};

template <int Dim>
struct Component : Part<Dim> {
  std::vector<Part<Dim>> cavities;
};

/// Something that was taken off a shape.
template <int Dim>
struct Removed {
  std::string what;    ///< "small component", "filled cavity", ...
  int n_parts = 1;     ///< with the cavities that went with a component
  double content = 0;  ///< [mm^Dim], signed: negative for a cavity
  Vector<Dim> center_mm = Vector<Dim>::Zero();
};

/// The final check and the measures of a shape.
template <int Dim>
struct Measures {
  bool passed = false;  ///< every guarantee holds
  std::string verdict;  ///< one sentence: that, or what is wrong and where
  bool closed = false;
  bool manifold = false;  ///< of curves: simple
  bool outward = false;   ///< of curves: holes and outer curves alternate
  int n_components = 0;   ///< connected parts of the boundary
  int n_self_intersections = 0;
  int n_degenerate = 0;
  Eigen::Index n_vertices = 0, n_elements = 0;
  double content = 0;  ///< [mm^Dim]
  double measure = 0;  ///< [mm^(Dim-1)]
  Vector<Dim> centroid_mm = Vector<Dim>::Zero();
  double min_angle_deg = 0, share_above_25_deg = 0;  ///< of triangles
  std::vector<Component<Dim>> components;            ///< if passed
};

}  // namespace surf::segment
