// Which triangles of a surface a surgery takes out. Private to surgery.
#pragma once

#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "libsurf/mesh/detail/connected_surface.h"
#include "libsurf/mesh/detail/grid_cells.h"

namespace surf::mesh {

/// Triangles within the reach of an event's centroid that are connected to it, events first.
/// @param events    triangles, each once
/// @param reach_mm  infinite: the whole components of the events
std::vector<int> neighbourhood(const ConnectedSurface& surface, const std::vector<int>& events,
                               double reach_mm = std::numeric_limits<double>::infinity());

/// What goes.
struct RemovedTriangles {
  TriangleFlags is_removed;
  std::vector<int> met;   ///< those in the cells
  std::vector<int> core;  ///< those that share no vertex with what stays
};

/// The triangles near and in the cells, one ring of them more, and what it takes to have each
/// vertex of the rim border on one run of what stays.
/// @param near  triangles that go, wherever the cells are
RemovedTriangles choose_removal(const ConnectedSurface& surface, const CubicGrid& grid,
                                const std::vector<int>& near, const GridCells& cells);

/// Where the rings round the cells meet, what is removed hangs together and the cells do not: adds
/// the triangles between to the region. True if there were any.
bool add_bridges(const ConnectedSurface& surface, const RemovedTriangles& removal,
                 std::vector<int>& near);

/// Adds parts of the core that are an edge wide, where cells may not hang together, to the region.
/// True if there were any.
bool add_necks(const ConnectedSurface& surface, const std::vector<int>& core,
               std::vector<int>& near);

/// Parts of a surface between its events that are too large to be looked at for each region anew.
/// Several threads may ask.
class LargeParts {
 public:
  /// @param surface  must outlive this object
  LargeParts(const ConnectedSurface& surface, const TriangleFlags& is_event);

  /// Whether a triangle is in one that bounds the domain: its winding numbers are 1 and 0 wherever
  /// it is cut.
  bool are_known_to_bound(int triangle);

 private:
  static constexpr std::size_t kLarge = 2000;  // triangles
  struct Part {
    std::size_t n_triangles;
    int largest;  // triangle
    std::optional<bool> bounds;
  };

  const ConnectedSurface& surface_;
  std::vector<int> part_;  // of the triangles; -1 = event
  std::vector<Part> parts_;
  std::mutex mutex_;  // of what is known of the parts
};

/// Removes parts of the surface that border on what is removed, cross no event and do not bound the
/// domain.
/// @param is_event  events of all regions: no part crosses them
/// @return events that such a part borders on; if there are any, what is removed is of no use
std::vector<int> remove_phantom_parts(const ConnectedSurface& surface, LargeParts& large,
                                      const TriangleFlags& is_event, TriangleFlags& is_removed);

}  // namespace surf::mesh
