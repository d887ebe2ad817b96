#include "libsurf/mesh/detail/grown_part.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "libsurf/mesh/marching_cubes.h"

namespace surf::mesh {
namespace {

using Index3 = std::array<int, 3>;

constexpr int kPad = 5;                    // cells between a region and the grid's border
constexpr double kOffset = 0.381966;       // of the grid, so that round numbers are no nodes
constexpr double kNearestCrossing = 0.05;  // of a vertex to the end of its grid edge
constexpr std::size_t kMostNodes = std::size_t(1) << 27;

int corners_inside(const CubicGrid& grid, const std::vector<std::uint8_t>& inside, int i, int j,
                   int k) {
  int corners = 0;
  for (int c = 0; c < 8; ++c)
    corners |= inside[grid.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] << c;
  return corners;
}

struct GridEdge {
  int axis;
  Index3 node;
};

/// Adds the cells round an edge, but for those at the grid's border.
void add_cells_round(const GridEdge& edge, const CubicGrid& grid, GridCells& cells) {
  const auto& [axis, node] = edge;
  for (int c = 0; c < 4; ++c) {
    Index3 cell = node;
    cell[(axis + 1) % 3] -= c & 1;
    cell[(axis + 2) % 3] -= c >> 1;
    if (*std::min_element(cell.begin(), cell.end()) >= 1 && cell[0] + 2 < grid.size[0] &&
        cell[1] + 2 < grid.size[1] && cell[2] + 2 < grid.size[2])
      cells.set(cell[0], cell[1], cell[2]);
  }
}

/// Points on grid edges, one per edge.
class EdgePoints {
 public:
  /// @param winding  referred to
  EdgePoints(const WindingGrid& winding, int first_vertex)
      : winding_(winding), first_vertex_(first_vertex) {}

  /// Vertex on an edge of a cell, new if the edge has none yet.
  int vertex_on(int edge, const Index3& cell, GrownPart& part) {
    const CubicGrid& grid = winding_.grid();
    const auto [axis, c] = cube_edge(edge);
    const Index3 node = {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)};
    const std::uint64_t key = grid.node(node[0], node[1], node[2]) * 3 + axis;
    const auto [at, is_new] = vertices_.emplace(key, first_vertex_ + int(part.points.size()));
    if (!is_new) return at->second;
    double share = winding_.crossing(axis, node);
    part.is_loose.push_back(share == 0);
    share = share == 0 ? 0.5 : std::clamp(share, kNearestCrossing, 1 - kNearestCrossing);
    Vector<3> point = grid.position(node[0], node[1], node[2]);
    point[axis] += share * grid.spacing;
    part.points.push_back(point);
    edges_.push_back({axis, node});
    return at->second;
  }

  const GridEdge& edge_of(int vertex) const { return edges_[vertex - first_vertex_]; }

 private:
  const WindingGrid& winding_;
  int first_vertex_;
  std::unordered_map<std::uint64_t, int> vertices_;  // by grid edges
  std::vector<GridEdge> edges_;                      // of the vertices
};

}  // namespace

std::optional<CubicGrid> grid_round(const ConnectedSurface& surface,
                                    const std::vector<int>& triangles, double spacing_mm) {
  Eigen::AlignedBox3d box;
  for (const int t : triangles)
    for (int i = 0; i < 3; ++i) box.extend(surface.corner(t, i));
  const Eigen::Array3d first = (box.min().array() / spacing_mm - kOffset).floor() - kPad;
  const Eigen::Array3d last = (box.max().array() / spacing_mm - kOffset).ceil() + kPad;
  if ((last - first + 1).prod() > double(kMostNodes)) return std::nullopt;
  CubicGrid grid;
  grid.spacing = spacing_mm;
  grid.origin = (first + kOffset) * spacing_mm;
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = int(last[axis] - first[axis]) + 1;
  return grid;
}

void open_thin_parts(const CubicGrid& grid, const GridCells& zone, std::uint8_t flag,
                     std::vector<std::uint8_t>& inside) {
  const std::vector<std::uint8_t> before = inside;
  const auto is_full = [&](int i, int j, int k) {
    for (int c = 0; c < 8; ++c)
      if (before[grid.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] != flag) return false;
    return true;
  };
  const auto is_thick = [&](int i, int j, int k) {
    for (int c = 0; c < 8; ++c)
      if (is_full(i - (c & 1), j - (c >> 1 & 1), k - (c >> 2))) return true;
    return false;
  };
  zone.for_each([&](int i, int j, int k) {
    for (int c = 0; c < 8; ++c) {
      const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2);
      if (before[grid.node(x, y, z)] == flag && !is_thick(x, y, z))
        inside[grid.node(x, y, z)] = !flag;
    }
  });
}

std::optional<GrownPart> grow(const std::vector<std::uint8_t>& inside, const WindingGrid& winding,
                              int first_vertex, GridCells& cells) {
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    GrownPart part;
    EdgePoints points(winding, first_vertex);
    cells.for_each([&](int i, int j, int k) {
      for (const auto& edges : cube_triangles(corners_inside(winding.grid(), inside, i, j, k))) {
        std::array<int, 3> triangle;
        for (int v = 0; v < 3; ++v) triangle[v] = points.vertex_on(edges[v], {i, j, k}, part);
        part.triangles.push_back(triangle);
      }
    });
    const std::vector<Side> sides = free_sides(part.triangles);
    const std::vector<int> crowded = crowded_vertices(sides);
    if (crowded.empty()) {
      auto loops = rims(sides);
      if (!loops) return std::nullopt;
      part.rims = std::move(*loops);
      part.has_more_cells = round > 0;
      return part;
    }
    for (const int vertex : crowded) add_cells_round(points.edge_of(vertex), winding.grid(), cells);
  }
  return std::nullopt;
}

}  // namespace surf::mesh
