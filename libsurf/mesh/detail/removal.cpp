#include "libsurf/mesh/detail/removal.h"

#include <algorithm>
#include <map>
#include <set>

#include "libsurf/mesh/detail/winding_grid.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

constexpr std::size_t kSmallestIsland = 40;  // triangles

void remove_star(const ConnectedSurface& surface, int vertex, TriangleFlags& is_removed) {
  for (const int t : surface.stars[vertex]) is_removed[t] = 1;
}

void remove_in_cells(const ConnectedSurface& surface, const CubicGrid& grid, const GridCells& cells,
                     TriangleFlags& is_removed) {
  for (const int t : surface.triangles_near(grid.box()))
    if (!is_removed[t]) is_removed[t] = cells.is_any_at(surface.triangles, t);
}

/// Flags of the vertices of chosen triangles that others have too.
std::vector<char> border_vertices(const ConnectedSurface& surface, const TriangleFlags& is_chosen) {
  std::vector<char> is_border(surface.n_vertices(), 0);
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; is_chosen[t] && i < 3; ++i) {
      if (is_chosen[surface.across(t, i)]) continue;
      // The run of chosen triangles round a vertex ends at a side.
      is_border[surface.vertex(t, i)] = is_border[surface.vertex(t, (i + 1) % 3)] = 1;
    }
  return is_border;
}

/// Vertices whose removed triangles are more than one run lose the others too.
void make_rims_simple(const ConnectedSurface& surface, TriangleFlags& is_removed) {
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    std::map<int, int> n_begins;
    for (int t = 0; t < surface.n_triangles(); ++t) {
      if (!is_removed[t]) continue;
      for (int i = 0; i < 3; ++i) {
        const int from = surface.vertex(t, i);
        if (is_removed[surface.across(t, i)]) continue;
        if (++n_begins[from] == 2) {
          remove_star(surface, from, is_removed);
          is_changed = true;
        }
      }
    }
  }
}

/// Where two rings border on each other with no more than an edge between, the stars of its ends
/// go too. True if there were any.
bool remove_chords(const ConnectedSurface& surface, TriangleFlags& is_removed) {
  const std::vector<char> is_border = border_vertices(surface, is_removed);
  std::vector<int> ends;
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; is_removed[t] && i < 3; ++i) {
      const int from = surface.vertex(t, i), to = surface.vertex(t, (i + 1) % 3);
      if (is_border[from] && is_border[to] && is_removed[surface.across(t, i)])
        ends.insert(ends.end(), {from, to});
    }
  for (const int vertex : ends) remove_star(surface, vertex, is_removed);
  return !ends.empty();
}

/// Small parts of the surface that are left within what is removed go too. True if there were any.
bool remove_islands(const ConnectedSurface& surface, TriangleFlags& is_removed) {
  enum : char { kUnseen, kSmall, kLarge };
  std::vector<char> state(surface.n_triangles(), kUnseen);
  bool is_any = false;
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; is_removed[t] && i < 3; ++i) {
      const int start = surface.across(t, i);
      if (is_removed[start] || state[start] != kUnseen) continue;
      std::vector<int> part = {start};
      state[start] = kSmall;
      bool is_large = false;
      for (std::size_t at = 0; at < part.size() && !is_large; ++at)
        for (int side = 0; side < 3; ++side) {
          const int next = surface.across(part[at], side);
          if (is_removed[next] || state[next] == kSmall) continue;
          is_large |= state[next] == kLarge || part.size() >= kSmallestIsland;
          state[next] = kSmall;
          part.push_back(next);
        }
      for (const int s : part) {
        if (is_large) state[s] = kLarge;
        if (!is_large) is_removed[s] = 1;
      }
      is_any |= !is_large;
    }
  return is_any;
}

/// Number of runs of chosen triangles round a vertex.
int n_runs(const ConnectedSurface& surface, int vertex, const TriangleFlags& is_chosen) {
  int n = 0;
  for (const int t : surface.stars[vertex])
    for (int i = 0; is_chosen[t] && i < 3; ++i)
      n += surface.vertex(t, i) == vertex && !is_chosen[surface.across(t, i)];
  return n;
}

/// Whether the Euler characteristic of some triangles changes when others are added.
bool changes_topology(const ConnectedSurface& surface, const std::vector<int>& added,
                      const TriangleFlags& is_there, const std::vector<char>& is_vertex_there) {
  const std::set<int> all_added(added.begin(), added.end());
  std::set<int> vertices;
  int n_sides = 0;  // each edge twice
  for (const int t : added)
    for (int i = 0; i < 3; ++i) {
      if (const int v = surface.vertex(t, i); !is_vertex_there[v]) vertices.insert(v);
      if (const int other = surface.across(t, i); !is_there[other])
        n_sides += all_added.contains(other) ? 1 : 2;
    }
  return int(vertices.size()) - n_sides / 2 + int(added.size()) != 0;
}

int largest_of(const ConnectedSurface& surface, const std::vector<int>& triangles) {
  int largest = triangles.front();
  double most = 0;
  for (const int t : triangles) {
    const double area =
        area_normal(surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)).squaredNorm();
    if (area > most) most = area, largest = t;
  }
  return largest;
}

/// Triangles that stay and share a vertex with one that is removed, some more than once.
std::vector<int> staying_at_rims(const ConnectedSurface& surface, const TriangleFlags& is_removed) {
  std::vector<int> out;
  for (int t = 0; t < surface.n_triangles(); ++t) {
    if (!is_removed[t]) continue;
    for (int i = 0; i < 3; ++i)
      for (const int s : surface.stars[surface.vertex(t, i)])
        if (!is_removed[s]) out.push_back(s);
  }
  return out;
}

}  // namespace

std::vector<int> neighbourhood(const ConnectedSurface& surface, const std::vector<int>& events,
                               double reach_mm) {
  std::vector<char> is_reached(surface.n_triangles(), 0);
  std::vector<int> queue;
  std::vector<Vector<3>> sources;  // of each in the queue
  for (const int t : events) {
    is_reached[t] = 1;
    queue.push_back(t);
    sources.push_back(surface.centroid(t));
  }
  for (std::size_t at = 0; at < queue.size(); ++at) {
    const Vector<3> source = sources[at];
    for (int i = 0; i < 3; ++i)
      for (const int t : surface.stars[surface.vertex(queue[at], i)]) {
        if (is_reached[t] || (surface.centroid(t) - source).norm() > reach_mm) continue;
        is_reached[t] = 1;
        queue.push_back(t);
        sources.push_back(source);
      }
  }
  return queue;
}

RemovedTriangles choose_removal(const ConnectedSurface& surface, const CubicGrid& grid,
                                const std::vector<int>& near, const GridCells& cells) {
  RemovedTriangles out{TriangleFlags(surface.n_triangles(), 0), {}, {}};
  TriangleFlags& is_removed = out.is_removed;
  for (const int t : near) is_removed[t] = 1;
  remove_in_cells(surface, grid, cells, is_removed);
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (is_removed[t]) out.met.push_back(t);
  for (const int t : out.met)
    for (int i = 0; i < 3; ++i) remove_star(surface, surface.vertex(t, i), is_removed);
  do make_rims_simple(surface, is_removed);
  while (remove_chords(surface, is_removed) || remove_islands(surface, is_removed));
  const std::vector<char> is_border = border_vertices(surface, is_removed);
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (is_removed[t] && !is_border[surface.vertex(t, 0)] && !is_border[surface.vertex(t, 1)] &&
        !is_border[surface.vertex(t, 2)])
      out.core.push_back(t);
  return out;
}

bool add_bridges(const ConnectedSurface& surface, const RemovedTriangles& removal,
                 std::vector<int>& near) {
  TriangleFlags is_met(surface.n_triangles(), 0), is_between(surface.n_triangles(), 0);
  std::vector<char> is_met_vertex(surface.n_vertices(), 0);
  for (const int t : removal.met) {
    is_met[t] = 1;
    for (int i = 0; i < 3; ++i) is_met_vertex[surface.vertex(t, i)] = 1;
  }
  for (const int t : removal.core) is_between[t] = !is_met[t];
  const std::size_t n_before = near.size();
  for (const int start : removal.core) {
    if (!is_between[start]) continue;
    std::vector<int> bridge = {start};
    is_between[start] = 0;
    for (std::size_t at = 0; at < bridge.size(); ++at)
      for (int side = 0; side < 3; ++side)
        if (const int next = surface.across(bridge[at], side); is_between[next]) {
          is_between[next] = 0;
          bridge.push_back(next);
        }
    if (changes_topology(surface, bridge, is_met, is_met_vertex))
      near.insert(near.end(), bridge.begin(), bridge.end());
  }
  for (const int t : removal.core)  // where two parts touch in a vertex
    for (int i = 0; i < 3; ++i) {
      const int vertex = surface.vertex(t, i);
      if (!is_met_vertex[vertex] || n_runs(surface, vertex, is_met) <= 1) continue;
      for (const int s : surface.stars[vertex])
        if (!is_met[s]) near.push_back(s);
    }
  return near.size() > n_before;
}

bool add_necks(const ConnectedSurface& surface, const std::vector<int>& core,
               std::vector<int>& near) {
  TriangleFlags is_core(surface.n_triangles(), 0), is_near(surface.n_triangles(), 0);
  for (const int t : core) is_core[t] = 1;
  for (const int t : near) is_near[t] = 1;
  const std::vector<char> is_rim = border_vertices(surface, is_core);
  const std::size_t n_before = near.size();
  for (const int t : core)
    for (int i = 0; i < 3; ++i) {
      const int from = surface.vertex(t, i), to = surface.vertex(t, (i + 1) % 3);
      const int other = surface.across(t, i);
      if (!is_rim[from] || !is_rim[to] || !is_core[other]) continue;
      for (const int s : {t, other})
        if (!is_near[s]) {
          is_near[s] = 1;
          near.push_back(s);
        }
    }
  return near.size() > n_before;
}

LargeParts::LargeParts(const ConnectedSurface& surface, const TriangleFlags& is_event)
    : surface_(surface), part_(surface.n_triangles(), -1) {
  std::vector<int> queue;
  for (int start = 0; start < surface.n_triangles(); ++start) {
    if (part_[start] >= 0 || is_event[start]) continue;
    const int part = int(parts_.size());
    queue = {start};
    part_[start] = part;
    for (std::size_t at = 0; at < queue.size(); ++at)
      for (int i = 0; i < 3; ++i)
        if (const int next = surface.across(queue[at], i); part_[next] < 0 && !is_event[next]) {
          part_[next] = part;
          queue.push_back(next);
        }
    parts_.push_back({queue.size(), largest_of(surface, queue), {}});
  }
}

bool LargeParts::are_known_to_bound(int triangle) {
  if (part_[triangle] < 0) return false;
  Part& part = parts_[part_[triangle]];
  if (part.n_triangles < kLarge) return false;
  const auto known = [&] {
    const std::lock_guard lock(mutex_);
    return part.bounds;
  };
  if (const auto bounds = known()) return *bounds;
  const bool bounds =
      winding_beside(surface_.triangles.points, surface_.triangles.elements, part.largest).outer ==
      0;
  const std::lock_guard lock(mutex_);
  part.bounds = bounds;
  return bounds;
}

std::vector<int> remove_phantom_parts(const ConnectedSurface& surface, LargeParts& large,
                                      const TriangleFlags& is_event, TriangleFlags& is_removed) {
  std::vector<int> wanted;
  TriangleFlags is_seen(surface.n_triangles(), 0);
  const TriangleFlags is_cut = is_removed;
  for (const int start : staying_at_rims(surface, is_cut)) {
    if (is_seen[start] || is_event[start] || large.are_known_to_bound(start)) continue;
    std::vector<int> part = {start}, border;
    is_seen[start] = 1;
    for (std::size_t at = 0; at < part.size(); ++at)
      for (int i = 0; i < 3; ++i) {
        const int t = surface.across(part[at], i);
        if (is_cut[t] || is_seen[t]) continue;
        if (is_event[t]) {
          border.push_back(t);
          continue;
        }
        is_seen[t] = 1;
        part.push_back(t);
      }
    const int largest = largest_of(surface, part);
    if (winding_beside(surface.triangles.points, surface.triangles.elements, largest).outer == 0)
      continue;
    wanted.insert(wanted.end(), border.begin(), border.end());
    for (const int t : part) is_removed[t] = 1;
  }
  if (wanted.empty()) make_rims_simple(surface, is_removed);
  return wanted;
}

}  // namespace surf::mesh
