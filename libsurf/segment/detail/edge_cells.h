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
/// is about distance_mm - sum_i reach_i u_i. Single precision: there are millions of them.
template <int Dim>
struct EdgeCell {
  std::uint64_t index = 0;  ///< of all cells or blocks, first axis fastest
  int element = -1;
  float distance_mm = 0;  ///< t sum_i lambda_i n_i . nu; negative inside
  float value = 0;        ///< as it was read, or the mean of a block
  float variance = 0;     ///< of the values in a block
  std::array<float, Dim> lambda = {};
  std::array<float, Dim> reach = {};  ///< lambda_i n_i . nu
};

/// The cells beside a shape, element by element, and how to come to them from its vertices and in
/// the order of their indices.
template <int Dim>
class EdgeCells {
 public:
  EdgeCells() = default;
  /// @param cells     element by element
  /// @param by_index  their places in ascending order of index
  EdgeCells(std::vector<EdgeCell<Dim>> cells, std::vector<std::uint32_t> by_index,
            const Elements<Dim>& elements, Eigen::Index n_vertices);

  std::size_t size() const { return cells_.size(); }
  auto begin() const { return cells_.begin(); }
  auto end() const { return cells_.end(); }
  const EdgeCell<Dim>& operator[](std::size_t place) const { return cells_[place]; }
  const std::vector<std::uint32_t>& by_index() const { return by_index_; }

  /// fn(place) of the cells beside an element, in their order.
  template <class Function>
  void for_each_beside(Eigen::Index element, const Function& fn) const {
    for (std::size_t k = first_[std::size_t(element)]; k < first_[std::size_t(element) + 1]; ++k)
      fn(k);
  }
  /// fn(place, corner) of those beside the elements round a vertex, which is that corner of them.
  template <class Function>
  void for_each_round(Eigen::Index vertex, const Function& fn) const {
    for (std::size_t k = round_[std::size_t(vertex)]; k < round_[std::size_t(vertex) + 1]; ++k)
      for_each_beside(corners_[k] / Dim,
                      [&](std::size_t place) { fn(place, int(corners_[k] % Dim)); });
  }

 private:
  std::vector<EdgeCell<Dim>> cells_;
  std::vector<std::uint32_t> by_index_;
  std::vector<std::size_t> first_;  // of the cells of each element
  std::vector<std::size_t> round_;  // of the corners of each vertex
  std::vector<int> corners_;        // element * Dim + corner
};

/// The blocks whose centres are no further than `reach` from a shape, along its normals; where
/// sheets are near each other a block belongs to the nearest. Elements on the image's border have
/// none. O(blocks in the boxes round the elements). None once a stop is requested.
/// @param normals  of the vertices, (n, Dim); 0 = has none
template <int Dim>
EdgeCells<Dim> edge_cells(const Setting<Dim>& setting, const fem::Geometry<Dim>& geometry,
                          const Points<Dim>& normals, double reach_mm,
                          const CellBlocks<Dim>& blocks, const std::stop_token& stop = {});

}  // namespace surf::segment
