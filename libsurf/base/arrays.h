// Arrays of points and elements from lists and from parts.
#pragma once

#include <array>
#include <vector>

#include "libsurf/base/types.h"

namespace surf {

/// One point, or one element, a row.
template <int Dim>
Points<Dim> points_of(const std::vector<Vector<Dim>>& list) {
  Points<Dim> out(Eigen::Index(list.size()), Dim);
  for (std::size_t i = 0; i < list.size(); ++i) out.row(Eigen::Index(i)) = list[i].transpose();
  return out;
}
template <std::size_t Dim>
Elements<int(Dim)> elements_of(const std::vector<std::array<int, Dim>>& list) {
  Elements<int(Dim)> out(Eigen::Index(list.size()), Dim);
  for (std::size_t i = 0; i < list.size(); ++i)
    for (std::size_t k = 0; k < Dim; ++k) out(Eigen::Index(i), Eigen::Index(k)) = list[i][k];
  return out;
}

/// All parts as one shape, Segments or Triangles, one after the other.
template <class Shape>
Shape all_of(const std::vector<Shape>& parts) {
  Eigen::Index n_points = 0, n_elements = 0;
  for (const Shape& part : parts) {
    n_points += part.points.rows();
    n_elements += part.elements.rows();
  }
  Shape out;
  out.points.resize(n_points, Eigen::NoChange);
  out.elements.resize(n_elements, Eigen::NoChange);
  n_points = n_elements = 0;
  for (const Shape& part : parts) {
    out.points.middleRows(n_points, part.points.rows()) = part.points;
    out.elements.middleRows(n_elements, part.elements.rows()) =
        part.elements.array() + static_cast<int>(n_points);
    n_points += part.points.rows();
    n_elements += part.elements.rows();
  }
  return out;
}

}  // namespace surf
