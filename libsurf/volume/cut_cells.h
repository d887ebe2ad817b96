// Cells of a grid cut by a closed surface: the moments of what lies inside and outside.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "libsurf/base/types.h"
#include "libsurf/fem/trilinear.h"
#include "libsurf/volume/tiled_field.h"

namespace surf::volume {

using fem::Moments;

/// What of each cell of a grid belongs to a domain. Cell (i, j, k) lies between the nodes (i, j, k)
/// and (i + 1, j + 1, k + 1).
struct DomainCells {
  static constexpr std::int32_t kEmpty = -2, kFull = -1;

  std::array<int, 3> size;          ///< cells along each axis
  std::vector<std::int32_t> state;  ///< kEmpty, kFull, or a row of `moments`; i fastest
  std::vector<Moments> moments;     ///< of the cells that are cut

  std::size_t cell(int i, int j, int k) const {
    return (std::size_t(k) * size[1] + j) * size[0] + i;
  }
  /// State of a cell; kEmpty out of the grid.
  std::int32_t at(int i, int j, int k) const {
    const bool is_in = i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2];
    return is_in ? state[cell(i, j, k)] : kEmpty;
  }
};

/// The cells of a grid inside and outside a closed surface, by the divergence theorem: exact for
/// the polyhedron, up to rounding. O(triangles + pieces in cells + cells); the same for any number
/// of threads.
///
/// The surface may reach out of the grid. Where it winds more than once or less than not at all,
/// as parts of a surface that is about to merge with itself, moments are not those of any part of
/// the cell; such a cell gets a share of the whole cell's moments.
///
/// @param points, elements  closed, outward [mm]
/// @param grid              nodes
/// @return  inside, outside
std::array<DomainCells, 2> cut_cells(const Points<3>& points, const Elements<3>& elements,
                                     const Grid& grid);

/// The same with the share `share` of the integrals over the domain's part of each cut cell
/// replaced by the mean over the cell times the part's volume. It is of second order where the
/// integrand is smooth, linear in the domain, and makes the matrices of small parts as well
/// conditioned as those of whole cells.
DomainCells blended(const DomainCells& cells, double share);

/// The same domain on cells `factor` (1 or 2 along each axis) times as long; the last ones may
/// reach out of the grid, where the domain is empty.
DomainCells coarsened(const DomainCells& fine, const std::array<int, 3>& factor);

}  // namespace surf::volume
