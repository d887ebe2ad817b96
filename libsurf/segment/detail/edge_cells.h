// The cells of an image beside a shape, or blocks of them, each with its place along the shape's
// normals.
#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "libsurf/fem/geometry.h"
#include "libsurf/segment/setting.h"

namespace surf::segment {

/// Blocks of side^Dim cells of an image, in its middle, with the means of their cells as values:
/// cells of a coarser image. What is left over at its faces belongs to none.
template <int Dim>
struct CellBlocks {
  int side = 1;
  std::array<int, Dim> first = {};  ///< cell of the first block
  ImageBox<Dim> box;                ///< of the blocks' centres

  /// @pre  1 <= side <= size of the image along each axis
  CellBlocks(const ImageBox<Dim>& cells, int cells_along_a_side) : side(cells_along_a_side) {
    Vector<Dim> centre;
    for (int axis = 0; axis < Dim; ++axis) {
      box.size[axis] = cells.size[axis] / side;
      first[axis] = cells.size[axis] % side / 2;
      centre[axis] = first[axis] + (side - 1) / 2.0;
    }
    box.index_to_world = cells.index_to_world * Eigen::Translation<double, Dim>(centre) *
                         Eigen::UniformScaling<double>(side);
    box.world_to_index = box.index_to_world.inverse();
  }
};

/// A cell centre x = sum_i lambda_i (p_i + t n_i) beside the element with vertices p_i, along their
/// normals n_i. If each vertex moves by u_i n_i, the cell's signed distance to the element's plane
/// is about distance_mm - sum_i reach_i u_i.
template <int Dim>
struct EdgeCell {
  std::uint64_t index = 0;  ///< of all cells or blocks, first axis fastest
  int element = -1;
  double distance_mm = 0;  ///< t sum_i lambda_i n_i . nu; negative inside
  double value = 0;        ///< as it was read, or the mean of a block
  double variance = 0;     ///< of the values in a block
  std::array<double, Dim> lambda = {};
  std::array<double, Dim> reach = {};  ///< lambda_i n_i . nu
};

/// The blocks whose centres are no further than `reach` from a shape, along its normals; where
/// sheets are near each other a block belongs to the nearest. Elements on the image's border have
/// none. Ordered by index. O(blocks in the boxes round the elements). None once a stop is
/// requested.
/// @param normals  of the vertices, (n, Dim); 0 = has none
template <int Dim>
std::vector<EdgeCell<Dim>> edge_cells(const Setting<Dim>& setting,
                                      const fem::Geometry<Dim>& geometry,
                                      const Points<Dim>& normals, double reach_mm,
                                      const CellBlocks<Dim>& blocks,
                                      const std::stop_token& stop = {});

}  // namespace surf::segment
