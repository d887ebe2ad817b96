// What grows on a grid in the place of a part of a surface: the boundary of a domain by marching
// cubes. Private to surgery.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "libsurf/mesh/detail/connected_surface.h"
#include "libsurf/mesh/detail/grid_cells.h"
#include "libsurf/mesh/detail/rims.h"
#include "libsurf/mesh/detail/winding_grid.h"

namespace surf::mesh {

/// The grid round some triangles: nodes at fixed places of space, and some cells between the
/// triangles and its border. None if it had too many nodes for the memory.
std::optional<CubicGrid> grid_round(const ConnectedSurface& surface,
                                    const std::vector<int>& triangles, double spacing_mm);

/// Nodes of some cells with the given flag that are in no cell of nodes with this flag only get the
/// other one: walls and gaps thinner than a cell go.
/// @param zone    cells, none at the border of the grid
/// @param inside  one flag per node
void open_thin_parts(const CubicGrid& grid, const GridCells& zone, std::uint8_t flag,
                     std::vector<std::uint8_t>& inside);

/// A surface in cells of a grid. Its vertices lie on the grid's edges; their numbers begin at a
/// given one.
struct GrownPart {
  std::vector<Vector<3>> points;
  std::vector<std::array<int, 3>> triangles;
  std::vector<char> is_loose;  ///< of the points: on no crossing of the surface, in the middle
  std::vector<Rim> rims;       ///< its sides run as those of the triangles
  bool has_more_cells = false;
};

/// Marching cubes in some cells. Cells are added where the part would touch itself in a vertex of
/// its rim; none if it does so even then.
/// @param inside        one flag per node of the grid
/// @param winding       where the grid's edges cross the domain's boundary
/// @param first_vertex  number of the first point
std::optional<GrownPart> grow(const std::vector<std::uint8_t>& inside, const WindingGrid& winding,
                              int first_vertex, GridCells& cells);

}  // namespace surf::mesh
