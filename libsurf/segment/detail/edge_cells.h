// The cells of an image beside a shape, each with its place along the shape's normals.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "libsurf/fem/geometry.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

/// A cell centre x = sum_i lambda_i (p_i + t n_i) beside the element with vertices p_i, along their
/// normals n_i. If each vertex moves by u_i n_i, the cell's signed distance to the element's plane
/// is about distance_mm - sum_i reach_i u_i.
template <int Dim>
struct EdgeCell {
  std::uint64_t index = 0;  ///< in the image, first axis fastest
  int element = -1;
  double distance_mm = 0;  ///< t sum_i lambda_i n_i . nu; negative inside
  double value = 0;        ///< as it was read
  std::array<double, Dim> lambda = {};
  std::array<double, Dim> reach = {};  ///< lambda_i n_i . nu
};

/// The cells that are no further than `reach` from a shape, along its normals; where sheets are
/// near each other a cell belongs to the nearest. Elements on the image's border have none. Ordered
/// by index. O(cells in the boxes round the elements). None once a stop is requested.
/// @param normals  of the vertices, (n, Dim); 0 = has none
template <int Dim>
std::vector<EdgeCell<Dim>> edge_cells(const Setting<Dim>& setting,
                                      const fem::Geometry<Dim>& geometry,
                                      const Points<Dim>& normals, double reach_mm,
                                      const std::stop_token& stop = {});

}  // namespace surf::segment
