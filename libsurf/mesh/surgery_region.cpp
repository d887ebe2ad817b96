#include "libsurf/mesh/surgery_region.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>

#include "libsurf/mesh/annulus.h"
#include "libsurf/mesh/edge_uses.h"
#include "libsurf/mesh/grid_cells.h"
#include "libsurf/mesh/marching_cubes.h"
#include "libsurf/mesh/triangle_shape.h"
#include "libsurf/mesh/winding_grid.h"

namespace surf::mesh {
namespace {

using OpenMesh::FaceHandle;
using Index3 = std::array<int, 3>;

constexpr int kAttempts = 4;  // of a plan that fails, with more cells in narrow parts
constexpr std::size_t kSmallestIsland = 40;  // triangles
constexpr int kPad = 5;                      // cells between a region and the grid's border
constexpr double kOffset = 0.381966;         // of the grid, so that round numbers are no nodes
constexpr double kShortRim = 12;             // in units of the resolution
constexpr double kNearestCrossing = 0.05;    // of a vertex to the end of its grid edge
constexpr int kSmoothings = 6;               // of vertices that lie on no crossing
constexpr std::size_t kMostNodes = std::size_t(1) << 27;

/// The face across the side of each corner and the next one, in the order of elements().
Elements<3> neighbours(const TriMesh& mesh) {
  Elements<3> out(mesh.n_faces(), 3);
  for (int t = 0; t < out.rows(); ++t) {
    auto side = mesh.halfedge_handle(FaceHandle(t));
    for (int i = 0; i < 3; ++i, side = mesh.next_halfedge_handle(side))
      out(t, i) = mesh.face_handle(mesh.opposite_halfedge_handle(side)).idx();
  }
  return out;
}

using Side = std::pair<int, int>;  // from, to

/// Directed sides as closed polygons; none where a vertex begins more than one of them.
std::optional<std::vector<std::vector<int>>> rims(const std::vector<Side>& sides,
                                                  std::vector<int>* crowded = nullptr) {
  std::map<int, int> next;
  bool is_crowded = false;
  for (const auto& [from, to] : sides)
    if (!next.emplace(from, to).second) {
      is_crowded = true;
      if (crowded) crowded->push_back(from);
    }
  if (is_crowded) return std::nullopt;
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    std::vector<int> loop;
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      if (loop.empty()) loop.push_back(at->first);
      loop.push_back(at->second);
      next.erase(at);
    }
    if (loop.front() != loop.back()) return std::nullopt;
    loop.pop_back();
    loops.push_back(std::move(loop));
  }
  return loops;
}

/// Sides of triangles that no other one runs through the other way.
std::vector<Side> free_sides(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (const auto& triangle : triangles)
    for (int i = 0; i < 3; ++i) sides.emplace_back(triangle[i], triangle[(i + 1) % 3]);
  std::sort(sides.begin(), sides.end());
  std::vector<Side> out;
  for (const Side& side : sides)
    if (!std::binary_search(sides.begin(), sides.end(), Side(side.second, side.first)))
      out.push_back(side);
  return out;
}

/// Plans the patch for a region of a surface.
class Region {
 public:
  using State = RegionPlan::State;

  Region(const ConnectedSurface& surface, const std::vector<char>& is_event, double resolution)
      : connected_(surface),
        surface_(surface.triangles),
        stars_(surface.stars),
        across_(surface.across),
        is_event_(is_event),
        h_(resolution),
        n_vertices_(static_cast<int>(surface_.points.rows())),
        is_removed_(surface_.elements.rows(), 0) {}

  RegionPlan plan(const RegionRequest& request) {
    events_ = request.events;
    std::vector<int> near =
        std::isfinite(request.reach_mm) ? neighbourhood(request.reach_mm) : components();
    near.insert(near.end(), request.others.begin(), request.others.end());
    State state = plan_with(near);
    for (int attempt = 1; attempt < kAttempts && state == State::kFails; ++attempt) {
      if (!add_necks(near)) break;
      state = plan_with(near);
    }
    return {state, std::move(patch_), std::move(wanted_)};
  }

 private:
  State plan_with(std::vector<int>& near) {
    wanted_.clear();
    std::optional<GridCells> cells, zone;
    for (bool is_complete = false; !is_complete;) {
      if (!make_grid(near)) return State::kFails;
      cells.emplace(grid_);
      zone.emplace(grid_);
      cover(near, *cells, *zone);
      remove(near, *cells);
      is_complete = !add_bridges(near);
    }
    fill(*cells);
    const WindingGrid winding(surface_.points, surface_.elements, grid_);
    inside_ = winding.inside();
    open_thin_parts(*zone, 0);
    open_thin_parts(*zone, 1);
    bool has_more_cells = false;
    if (!march(*cells, winding, has_more_cells)) return State::kFails;
    if (has_more_cells) remove(std::vector<int>(core_), *cells);
    if (const State state = remove_phantom_parts(); state != State::kFits) return state;
    return join() ? State::kFits : State::kFails;
  }

  /// Triangles within the reach of an event's centroid that are connected to it.
  std::vector<int> neighbourhood(double reach) const {
    struct Reached {
      int triangle;
      Vector<3> source;
    };
    std::vector<char> is_reached(surface_.elements.rows(), 0);
    std::vector<Reached> queue;
    for (const int t : events_) {
      is_reached[t] = 1;
      queue.push_back({t, connected_.centroid(t)});
    }
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const Reached from = queue[at];
      for (int i = 0; i < 3; ++i)
        for (const int t : stars_[surface_.elements(from.triangle, i)]) {
          if (is_reached[t] || (connected_.centroid(t) - from.source).norm() > reach) continue;
          is_reached[t] = 1;
          queue.push_back({t, from.source});
        }
    }
    std::vector<int> out;
    for (const Reached& reached : queue) out.push_back(reached.triangle);
    return out;
  }

  /// All triangles connected to the events.
  std::vector<int> components() const {
    std::vector<char> is_reached(surface_.elements.rows(), 0);
    std::vector<int> queue = events_;
    for (const int t : queue) is_reached[t] = 1;
    for (std::size_t at = 0; at < queue.size(); ++at)
      for (int i = 0; i < 3; ++i)
        for (const int t : stars_[surface_.elements(queue[at], i)])
          if (!is_reached[t]) {
            is_reached[t] = 1;
            queue.push_back(t);
          }
    return queue;
  }

  bool make_grid(const std::vector<int>& near) {
    Eigen::AlignedBox3d box;
    for (const int t : near)
      for (int i = 0; i < 3; ++i) box.extend(connected_.corner(t, i));
    grid_.spacing = h_;
    const Eigen::Array3d first = (box.min().array() / h_ - kOffset).floor() - kPad;
    const Eigen::Array3d last = (box.max().array() / h_ - kOffset).ceil() + kPad;
    grid_.origin = (first + kOffset) * h_;
    if ((last - first + 1).prod() > double(kMostNodes)) return false;
    for (int axis = 0; axis < 3; ++axis) grid_.size[axis] = int(last[axis] - first[axis]) + 1;
    return true;
  }

  /// The cells of a region, and those where thin parts are removed.
  void cover(const std::vector<int>& near, GridCells& cells, GridCells& zone) const {
    for (const int t : near) cells.set_at(surface_, t);
    cells.dilate(1);
    for (const int t : events_) zone.set_at(surface_, t);
    GridCells at_events = zone;
    zone.dilate(1);
    at_events.dilate(2);
    cells.add(at_events);
  }

  /// Adds the cells that meet triangles of the core alone: what the cells leave of them would be
  /// holes of the patch.
  void fill(GridCells& cells) const {
    GridCells of_core(grid_), of_others(grid_);
    std::vector<char> is_core(surface_.elements.rows(), 0);
    for (const int t : core_) is_core[t] = 1;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      (is_core[t] ? of_core : of_others).set_at(surface_, t);
    of_core.subtract(of_others);
    cells.add(of_core);
  }

  /// Nodes of the zone with the given flag that are in no cell of nodes with this flag only get
  /// the other one.
  void open_thin_parts(const GridCells& zone, std::uint8_t flag) {
    const std::vector<std::uint8_t> before = inside_;
    const auto is_full = [&](int i, int j, int k) {
      for (int c = 0; c < 8; ++c)
        if (before[grid_.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] != flag) return false;
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
        if (before[grid_.node(x, y, z)] == flag && !is_thick(x, y, z))
          inside_[grid_.node(x, y, z)] = !flag;
      }
    });
  }

  int corners_inside(int i, int j, int k) const {
    int corners = 0;
    for (int c = 0; c < 8; ++c)
      corners |= inside_[grid_.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] << c;
    return corners;
  }

  /// Marching cubes in the cells; cells are added where the patch would touch itself in a vertex
  /// of its rim.
  bool march(GridCells& cells, const WindingGrid& winding, bool& has_more_cells) {
    constexpr int kRounds = 20;
    for (int round = 0; round < kRounds; ++round) {
      grown_ = {};
      place_.clear();
      is_loose_.clear();
      cells.for_each([&](int i, int j, int k) {
        for (const std::array<int, 3>& triangle : cube_triangles(corners_inside(i, j, k))) {
          std::array<int, 3> vertices;
          for (int v = 0; v < 3; ++v) vertices[v] = vertex_on(triangle[v], {i, j, k}, winding);
          grown_.triangles.push_back(vertices);
        }
      });
      std::vector<int> crowded;
      if (auto loops = rims(free_sides(grown_.triangles), &crowded)) {
        patch_rims_ = std::move(*loops);
        return true;
      }
      if (crowded.empty()) return false;
      for (const int vertex : crowded) add_cells_round(cells, vertex);
      has_more_cells = true;
    }
    return false;
  }

  struct GridEdge {
    int axis;
    Index3 node;
  };

  int vertex_on(int edge, const Index3& cell, const WindingGrid& winding) {
    const auto [axis, c] = cube_edge(edge);
    const Index3 node = {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)};
    const std::uint64_t key = grid_.node(node[0], node[1], node[2]) * 3 + axis;
    const auto [at, is_new] = place_.emplace(key, n_vertices_ + int(grown_.points.size()));
    if (!is_new) return at->second;
    double share = winding.crossing(axis, node);
    is_loose_.push_back(share == 0);
    share = share == 0 ? 0.5 : std::clamp(share, kNearestCrossing, 1 - kNearestCrossing);
    Vector<3> point = grid_.position(node[0], node[1], node[2]);
    point[axis] += share * h_;
    grown_.points.push_back(point);
    edges_of_.resize(grown_.points.size());
    edges_of_.back() = {axis, node};
    return at->second;
  }

  void add_cells_round(GridCells& cells, int vertex) const {
    const auto& [axis, node] = edges_of_[vertex - n_vertices_];
    for (int c = 0; c < 4; ++c) {
      Index3 cell = node;
      cell[(axis + 1) % 3] -= c & 1;
      cell[(axis + 2) % 3] -= c >> 1;
      if (*std::min_element(cell.begin(), cell.end()) >= 1 && cell[0] + 2 < grid_.size[0] &&
          cell[1] + 2 < grid_.size[1] && cell[2] + 2 < grid_.size[2])
        cells.set(cell[0], cell[1], cell[2]);
    }
  }

  /// The triangles in the cells, one ring of them more, and what it takes to have each vertex of
  /// the rim border on one run of what stays.
  void remove(const std::vector<int>& near, const GridCells& cells) {
    std::fill(is_removed_.begin(), is_removed_.end(), 0);
    for (const int t : near) is_removed_[t] = 1;
    const Eigen::Vector3d low = grid_.position(0, 0, 0),
                          high = grid_.position(grid_.size[0] - 1, grid_.size[1] - 1,
                                                grid_.size[2] - 1);
    for (int t = 0; t < surface_.elements.rows(); ++t) {
      if (is_removed_[t]) continue;
      bool is_far = false;
      for (int axis = 0; axis < 3 && !is_far; ++axis) {
        const auto [least, most] =
            std::minmax({connected_.corner(t, 0)[axis], connected_.corner(t, 1)[axis],
                         connected_.corner(t, 2)[axis]});
        is_far = most < low[axis] || least > high[axis];
      }
      if (!is_far) is_removed_[t] = cells.is_any_at(surface_, t);
    }
    core_.clear();
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t]) core_.push_back(t);
    for (const int t : core_)
      for (int i = 0; i < 3; ++i) remove_star(surface_.elements(t, i));
    met_ = core_;
    do make_rims_simple();
    while (remove_chords() || remove_islands());
    const std::vector<char> is_border = border_vertices();
    core_.clear();
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t] && !is_border[surface_.elements(t, 0)] &&
          !is_border[surface_.elements(t, 1)] && !is_border[surface_.elements(t, 2)])
        core_.push_back(t);
  }

  /// Flags of the vertices of triangles that stay.
  std::vector<char> border_vertices() const {
    std::vector<char> is_border(n_vertices_, 0);
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; !is_removed_[t] && i < 3; ++i) is_border[surface_.elements(t, i)] = 1;
    return is_border;
  }

  /// Where two rings border on each other with no more than an edge between, the stars of its ends
  /// go too. True if there were any.
  bool remove_chords() {
    const std::vector<char> is_border = border_vertices();
    std::vector<int> ends;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; is_removed_[t] && i < 3; ++i) {
        const int from = surface_.elements(t, i), to = surface_.elements(t, (i + 1) % 3);
        if (is_border[from] && is_border[to] && is_removed_[across_(t, i)])
          ends.insert(ends.end(), {from, to});
      }
    for (const int vertex : ends) remove_star(vertex);
    return !ends.empty();
  }

  /// Small parts of the surface that are left within what is removed go too. True if there were
  /// any.
  bool remove_islands() {
    enum : char { kUnseen, kSmall, kLarge };
    std::vector<char> state(surface_.elements.rows(), kUnseen);
    bool is_any = false;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; is_removed_[t] && i < 3; ++i) {
        const int start = across_(t, i);
        if (is_removed_[start] || state[start] != kUnseen) continue;
        std::vector<int> part = {start};
        state[start] = kSmall;
        bool is_large = false;
        for (std::size_t at = 0; at < part.size() && !is_large; ++at)
          for (int side = 0; side < 3; ++side) {
            const int next = across_(part[at], side);
            if (is_removed_[next] || state[next] == kSmall) continue;
            is_large |= state[next] == kLarge || part.size() >= kSmallestIsland;
            state[next] = kSmall;
            part.push_back(next);
          }
        for (const int s : part) {
          if (is_large) state[s] = kLarge;
          if (!is_large) is_removed_[s] = 1;
        }
        is_any |= !is_large;
      }
    return is_any;
  }

  /// Where the rings round the cells meet, what is removed hangs together and the cells do not: the
  /// triangles between join the region. True if there were any.
  bool add_bridges(std::vector<int>& near) const {
    std::vector<char> is_met(surface_.elements.rows(), 0), is_met_vertex(n_vertices_, 0),
        is_between(surface_.elements.rows(), 0);
    for (const int t : met_) {
      is_met[t] = 1;
      for (int i = 0; i < 3; ++i) is_met_vertex[surface_.elements(t, i)] = 1;
    }
    for (const int t : core_) is_between[t] = !is_met[t];
    const std::size_t n_before = near.size();
    for (const int start : core_) {
      if (!is_between[start]) continue;
      std::vector<int> bridge = {start};
      is_between[start] = 0;
      for (std::size_t at = 0; at < bridge.size(); ++at)
        for (int side = 0; side < 3; ++side)
          if (const int next = across_(bridge[at], side); is_between[next]) {
            is_between[next] = 0;
            bridge.push_back(next);
          }
      if (changes_topology(bridge, is_met, is_met_vertex))
        near.insert(near.end(), bridge.begin(), bridge.end());
    }
    for (const int t : core_)  // where two parts touch in a vertex
      for (int i = 0; i < 3; ++i)
        if (is_met_vertex[surface_.elements(t, i)] && n_runs(surface_.elements(t, i), is_met) > 1)
          for (const int s : stars_[surface_.elements(t, i)])
            if (!is_met[s]) near.push_back(s);
    return near.size() > n_before;
  }

  /// Parts of the core that are an edge wide, where cells may not hang together: they get more of
  /// them. True if there were any.
  bool add_necks(std::vector<int>& near) const {
    std::vector<char> is_core(surface_.elements.rows(), 0), is_rim(n_vertices_, 0),
        is_near(surface_.elements.rows(), 0);
    for (const int t : core_) is_core[t] = 1;
    for (const int t : near) is_near[t] = 1;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; !is_core[t] && i < 3; ++i) is_rim[surface_.elements(t, i)] = 1;
    const std::size_t n_before = near.size();
    for (const int t : core_)
      for (int i = 0; i < 3; ++i) {
        const int from = surface_.elements(t, i), to = surface_.elements(t, (i + 1) % 3);
        if (!is_rim[from] || !is_rim[to] || !is_core[across_(t, i)]) continue;
        for (const int s : {t, across_(t, i)})
          if (!is_near[s]) {
            is_near[s] = 1;
            near.push_back(s);
          }
      }
    return near.size() > n_before;
  }

  /// Number of runs of chosen triangles round a vertex.
  int n_runs(int vertex, const std::vector<char>& is_chosen) const {
    int n = 0;
    for (const int t : stars_[vertex])
      for (int i = 0; is_chosen[t] && i < 3; ++i)
        n += surface_.elements(t, i) == vertex && !is_chosen[across_(t, i)];
    return n;
  }

  /// Whether the Euler characteristic of some triangles changes when others are added.
  bool changes_topology(const std::vector<int>& added, const std::vector<char>& is_there,
                        const std::vector<char>& is_vertex_there) const {
    const std::set<int> all_added(added.begin(), added.end());
    std::set<int> vertices;
    int n_sides = 0;  // each edge twice
    for (const int t : added)
      for (int i = 0; i < 3; ++i) {
        if (const int v = surface_.elements(t, i); !is_vertex_there[v]) vertices.insert(v);
        if (const int other = across_(t, i); !is_there[other])
          n_sides += all_added.contains(other) ? 1 : 2;
      }
    return int(vertices.size()) - n_sides / 2 + int(added.size()) != 0;
  }

  void remove_star(int vertex) {
    for (const int t : stars_[vertex]) is_removed_[t] = 1;
  }

  /// Vertices whose removed triangles are more than one run lose the others too.
  void make_rims_simple() {
    for (bool is_changed = true; is_changed;) {
      is_changed = false;
      std::map<int, int> n_begins;
      for (int t = 0; t < surface_.elements.rows(); ++t) {
        if (!is_removed_[t]) continue;
        for (int i = 0; i < 3; ++i) {
          const int from = surface_.elements(t, i);
          if (is_removed_[across_(t, i)]) continue;
          if (++n_begins[from] == 2) {
            remove_star(from);
            is_changed = true;
          }
        }
      }
    }
  }

  /// Parts of the surface that border on what is removed, cross no event and do not bound the
  /// domain go too.
  State remove_phantom_parts() {
    wanted_.clear();
    std::vector<char> is_seen(surface_.elements.rows(), 0);
    std::vector<int> starts;
    for (int t = 0; t < surface_.elements.rows(); ++t) {
      if (!is_removed_[t]) continue;
      for (int i = 0; i < 3; ++i)
        for (const int s : stars_[surface_.elements(t, i)])
          if (!is_removed_[s]) starts.push_back(s);
    }
    const std::vector<char> is_cut = is_removed_;
    for (const int start : starts) {
      if (is_seen[start] || is_event_[start]) continue;
      std::vector<int> part = {start}, border;
      is_seen[start] = 1;
      for (std::size_t at = 0; at < part.size(); ++at)
        for (int i = 0; i < 3; ++i) {
          const int t = across_(part[at], i);
          if (is_cut[t] || is_seen[t]) continue;
          if (is_event_[t]) {
            border.push_back(t);
            continue;
          }
          is_seen[t] = 1;
          part.push_back(t);
        }
      if (winding_beside(surface_.points, surface_.elements, largest_of(part)).outer == 0) continue;
      wanted_.insert(wanted_.end(), border.begin(), border.end());
      for (const int t : part) is_removed_[t] = 1;
    }
    if (!wanted_.empty()) return State::kWantsMore;
    make_rims_simple();
    return State::kFits;
  }

  int largest_of(const std::vector<int>& triangles) const {
    int largest = triangles.front();
    double most = 0;
    for (const int t : triangles) {
      const double area =
          area_normal(connected_.corner(t, 0), connected_.corner(t, 1), connected_.corner(t, 2))
              .squaredNorm();
      if (area > most) most = area, largest = t;
    }
    return largest;
  }

  struct Match {
    int part_of_surface, part_of_patch;  // components that a strip joins
    const std::vector<int>*of_surface, *of_patch;
  };

  /// Joins the rims of what was removed to those of what has grown.
  bool join() {
    std::vector<Side> sides;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; is_removed_[t] && i < 3; ++i)
        if (!is_removed_[across_(t, i)])
          sides.emplace_back(surface_.elements(t, i), surface_.elements(t, (i + 1) % 3));
    const auto surface_rims = rims(sides);
    if (!surface_rims) return false;
    points_.resize(n_vertices_ + Eigen::Index(grown_.points.size()), 3);
    points_.topRows(n_vertices_) = surface_.points;
    for (std::size_t i = 0; i < grown_.points.size(); ++i)
      points_.row(n_vertices_ + Eigen::Index(i)) = grown_.points[i];
    DisjointSets parts(points_.rows());  // of what is removed, and of what has grown
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t])
        for (int i = 1; i < 3; ++i) parts.join(surface_.elements(t, 0), surface_.elements(t, i));
    for (const auto& triangle : grown_.triangles)
      for (int i = 1; i < 3; ++i) parts.join(triangle[0], triangle[i]);
    std::vector<char> has_event(points_.rows(), 0);
    for (const int t : events_) has_event[parts.find(surface_.elements(t, 0))] = 1;

    std::vector<Match> matches;
    if (!match(*surface_rims, parts, has_event, matches)) {
      for (const int t : core_)
        if (!has_event[parts.find(surface_.elements(t, 0))]) wanted_.push_back(t);
      return false;
    }
    leave_alone_what_has_no_event(parts, has_event, matches);
    return make_patch(matches);
  }

  /// Pairs of rims, each with the one that is closest. False if some rim has none.
  bool match(const std::vector<std::vector<int>>& surface_rims, DisjointSets& parts,
             const std::vector<char>& has_event, std::vector<Match>& matches) {
    double longest = kLongestEdgeAtEvent * h_;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      for (int i = 0; is_removed_[t] && i < 3; ++i)
        longest =
            std::max(longest, (connected_.corner(t, i) - connected_.corner(t, (i + 1) % 3)).norm());
    const double limit = 3 * longest;
    caps_.clear();
    std::vector<char> is_taken(patch_rims_.size(), 0);
    std::vector<char> is_free(points_.rows(), 0);  // parts without event with a rim of no partner
    for (const auto& rim : surface_rims) {
      double best = limit;
      int partner = -1;
      for (std::size_t p = 0; p < patch_rims_.size(); ++p) {
        const double gap =
            std::max(largest_gap(rim, patch_rims_[p]), largest_gap(patch_rims_[p], rim));
        if (gap < best) best = gap, partner = static_cast<int>(p);
      }
      const int part = parts.find(rim.front());
      if (partner < 0 || is_taken[partner]) {
        if (has_event[part] && !is_short(rim)) return false;
        if (has_event[part])
          caps_.push_back(rim);
        else
          is_free[part] = 1;
        continue;
      }
      is_taken[partner] = 1;
      matches.push_back(
          {part, parts.find(patch_rims_[partner].front()), &rim, &patch_rims_[partner]});
    }
    // What is left alone leaves its partners alone too.
    for (const Match& m : matches)
      if (is_free[m.part_of_surface]) return false;
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t] && is_free[parts.find(surface_.elements(t, 0))]) is_removed_[t] = 0;
    std::vector<char> is_joined(points_.rows(), 0);
    for (const Match& m : matches) is_joined[m.part_of_patch] = 1;
    for (std::size_t p = 0; p < patch_rims_.size(); ++p) {
      if (is_taken[p]) continue;
      if (!is_short(patch_rims_[p])) return false;
      if (is_joined[parts.find(patch_rims_[p].front())]) caps_.push_back(reversed(patch_rims_[p]));
    }
    // Scraps where cells meet the surface by a corner.
    std::vector<char> is_scrap(points_.rows(), 0);
    for (const auto& rim : patch_rims_) {
      const int part = parts.find(rim.front());
      is_scrap[part] = !is_joined[part];
    }
    std::erase_if(grown_.triangles,
                  [&](const auto& triangle) { return is_scrap[parts.find(triangle[0])]; });
    return true;
  }

  /// Of a neck that is too thin for the grid: it may be capped.
  bool is_short(const std::vector<int>& rim) const {
    double length = 0;
    for (std::size_t i = 0; i < rim.size(); ++i)
      length += (points_.row(rim[i]) - points_.row(rim[(i + 1) % rim.size()])).norm();
    return length < kShortRim * h_;
  }

  /// Largest distance of a vertex of one polygon to the nearest one of the other.
  double largest_gap(const std::vector<int>& from, const std::vector<int>& to) const {
    double largest = 0;
    for (const int v : from) {
      double least = std::numeric_limits<double>::infinity();
      for (const int w : to)
        least = std::min(least, (points_.row(v) - points_.row(w)).squaredNorm());
      largest = std::max(largest, least);
    }
    return std::sqrt(largest);
  }

  /// Sheets that pass through the cells without an event keep their triangles.
  void leave_alone_what_has_no_event(DisjointSets& parts, const std::vector<char>& has_event,
                                     std::vector<Match>& matches) {
    DisjointSets joined(points_.rows());
    for (const Match& m : matches) joined.join(m.part_of_surface, m.part_of_patch);
    std::vector<char> is_alive(points_.rows(), 0);
    for (const int t : events_) {
      const int part = parts.find(surface_.elements(t, 0));
      if (has_event[part]) is_alive[joined.find(part)] = 1;
    }
    const auto is_dead = [&](int part) { return !is_alive[joined.find(part)]; };
    std::vector<char> is_matched(points_.rows(), 0);
    for (const Match& m : matches) is_matched[m.part_of_surface] = is_matched[m.part_of_patch] = 1;
    for (int t = 0; t < surface_.elements.rows(); ++t) {
      if (!is_removed_[t]) continue;
      const int part = parts.find(surface_.elements(t, 0));
      if (is_matched[part] && is_dead(part)) is_removed_[t] = 0;
    }
    std::erase_if(grown_.triangles, [&](const auto& triangle) {
      const int part = parts.find(triangle[0]);
      return is_matched[part] && is_dead(part);
    });
    std::erase_if(matches, [&](const Match& m) { return is_dead(m.part_of_surface); });
  }

  bool make_patch(const std::vector<Match>& matches) {
    patch_ = {};
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t]) patch_.removed.push_back(t);
    std::vector<std::array<int, 3>> triangles = grown_.triangles;
    for (const Match& m : matches) {
      const auto strip = annulus(points_, *m.of_surface, reversed(*m.of_patch));
      triangles.insert(triangles.end(), strip.begin(), strip.end());
    }
    for (const auto& rim : caps_) add_cap(rim, triangles);
    smooth_loose_vertices(triangles);
    // Only the vertices that are used.
    std::unordered_map<int, int> number;
    for (auto& triangle : triangles)
      for (int& vertex : triangle) {
        if (vertex < n_vertices_) continue;
        const auto [at, is_new] = number.emplace(vertex, n_vertices_ + int(patch_.points.size()));
        if (is_new) patch_.points.push_back(points_.row(vertex));
        vertex = at->second;
      }
    patch_.triangles = std::move(triangles);
    return true;
  }

  /// A fan round a new vertex.
  void add_cap(const std::vector<int>& rim, std::vector<std::array<int, 3>>& triangles) {
    const int middle = static_cast<int>(points_.rows());
    points_.conservativeResize(middle + 1, 3);
    Vector<3> sum = Vector<3>::Zero();
    for (const int v : rim) sum += points_.row(v);
    points_.row(middle) = sum / double(rim.size());
    is_loose_.resize(middle + 1 - n_vertices_, 0);
    for (std::size_t i = 0; i < rim.size(); ++i)
      triangles.push_back({rim[i], rim[(i + 1) % rim.size()], middle});
  }

  /// The patch's sides at its rim run as its triangles do; the strip's run the other way.
  static std::vector<int> reversed(const std::vector<int>& loop) {
    return {loop.rbegin(), loop.rend()};
  }

  void smooth_loose_vertices(const std::vector<std::array<int, 3>>& triangles) {
    for (int round = 0; round < kSmoothings; ++round) {
      std::unordered_map<int, std::pair<Vector<3>, int>> sums;
      for (const auto& triangle : triangles)
        for (int i = 0; i < 3; ++i) {
          const int v = triangle[i];
          if (v < n_vertices_ || !is_loose_[v - n_vertices_]) continue;
          auto& [sum, n] = sums.try_emplace(v, Vector<3>::Zero(), 0).first->second;
          sum += points_.row(triangle[(i + 1) % 3]) + points_.row(triangle[(i + 2) % 3]);
          n += 2;
        }
      for (const auto& [v, mean] : sums) points_.row(v) = mean.first / mean.second;
    }
  }

  const ConnectedSurface& connected_;
  const Triangles& surface_;
  const Stars& stars_;
  const Elements<3>& across_;
  const std::vector<char>& is_event_;
  double h_;
  int n_vertices_;

  std::vector<int> events_, wanted_;
  CubicGrid grid_;
  std::vector<std::uint8_t> inside_;              // of the nodes
  std::vector<char> is_removed_;                  // of the triangles
  std::vector<int> met_;                          // of these, those in the cells
  std::vector<int> core_;                         // and those that share no vertex with what stays
  Patch grown_;                                   // by marching cubes
  std::unordered_map<std::uint64_t, int> place_;  // vertices by grid edges
  std::vector<GridEdge> edges_of_;
  std::vector<char> is_loose_;  // of the new vertices: on no crossing
  std::vector<std::vector<int>> patch_rims_, caps_;
  Points<3> points_;  // of the surface, and the new ones
  Patch patch_;
};

}  // namespace

ConnectedSurface::ConnectedSurface(const TriMesh& mesh)
    : triangles(to_triangles(mesh)),
      stars(triangles.elements, triangles.points.rows()),
      across(neighbours(mesh)) {}

RegionPlan plan_region(const ConnectedSurface& surface, const std::vector<char>& is_event,
                       const RegionRequest& request, double resolution_mm) {
  return Region(surface, is_event, resolution_mm).plan(request);
}

}  // namespace surf::mesh
