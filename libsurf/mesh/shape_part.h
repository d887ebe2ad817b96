// Some of a shape's elements as arrays of their own.
#pragma once

#include <vector>

#include "libsurf/base/types.h"

namespace surf::mesh {

template <int Dim>
struct ShapePart {
  Simplices<Dim> shape;
  std::vector<int> vertices;    ///< of the whole, in its order, for each of the part
  std::vector<int> elements;    ///< likewise
  std::vector<char> is_shared;  ///< vertices that elements have which are left out
};

/// @param is_left_out  one flag per element; empty = none is
template <int Dim>
ShapePart<Dim> part_of(const Simplices<Dim>& shape, const std::vector<char>& is_left_out);

/// The flags without those of elements that share a vertex with an element that is not left out.
template <int Dim>
std::vector<char> without_neighbours(const Elements<Dim>& T, std::vector<char> is_left_out);

}  // namespace surf::mesh
