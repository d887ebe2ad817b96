#include "libsurf/mesh/surgery.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/annulus.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/edge_uses.h"
#include "libsurf/mesh/marching_cubes.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/triangle_shape.h"
#include "libsurf/mesh/winding_grid.h"

namespace surf::mesh {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::VertexHandle;
using Index3 = std::array<int, 3>;

// In units of the resolution.
constexpr double kLongestEdge = 2.5;  // of faces near an event
constexpr double kReach = 2;          // of a region, along the surface
constexpr double kGrowthOfReach = 1.6;
constexpr int kMostGrowths = 3;
constexpr int kSmallestIsland = 40;   // triangles
constexpr int kPad = 5;               // cells between a region and the grid's border
constexpr double kOffset = 0.381966;  // of the grid, so that round numbers are no nodes
constexpr double kShortRim = 12;
constexpr double kNearestCrossing = 0.05;  // of a vertex to the end of its grid edge
constexpr int kSmoothings = 6;             // of vertices that lie on no crossing
constexpr std::size_t kMostNodes = std::size_t(1) << 27;

Vector<3> corner(const Triangles& surface, int triangle, int i) {
  return surface.points.row(surface.elements(triangle, i));
}

Vector<3> centroid_of(const Triangles& surface, int triangle) {
  return (corner(surface, triangle, 0) + corner(surface, triangle, 1) +
          corner(surface, triangle, 2)) /
         3;
}

/// The triangles of each vertex.
class Stars {
 public:
  Stars(const Elements<3>& elements, Eigen::Index n_vertices)
      : first_(n_vertices + 1, 0), triangles_(elements.size()) {
    for (const int vertex : elements.reshaped()) ++first_[vertex + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (int t = 0; t < elements.rows(); ++t)
      for (int i = 0; i < 3; ++i) triangles_[next[elements(t, i)]++] = t;
  }
  std::span<const int> operator[](int vertex) const {
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<int> first_, triangles_;
};

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

/// A surface and who is next to whom.
struct Connected {
  Triangles triangles;
  Stars stars;
  Elements<3> across;

  explicit Connected(const TriMesh& mesh)
      : triangles(to_triangles(mesh)),
        stars(triangles.elements, triangles.points.rows()),
        across(neighbours(mesh)) {}
};

/// Flags of the cells of a grid; cell (i, j, k) has the number of its first node.
class Cells {
 public:
  explicit Cells(const CubicGrid& grid) : grid_(grid), flags_(grid.n_nodes(), 0) {}

  bool operator()(int i, int j, int k) const { return flags_[grid_.node(i, j, k)] != 0; }
  void set(int i, int j, int k) { flags_[grid_.node(i, j, k)] = 1; }

  /// Calls visit(i, j, k) for cells that the triangle meets, and by chance a few next to it, until
  /// one returns true.
  template <class Visit>
  bool any_at(const Triangles& surface, int triangle, const Visit& visit) const {
    Eigen::Matrix3d index;
    for (int i = 0; i < 3; ++i)
      index.col(i) = (corner(surface, triangle, i) - grid_.origin) / grid_.spacing;
    Eigen::Array3d low = index.rowwise().minCoeff().array().floor(),
                   high = index.rowwise().maxCoeff().array().floor();
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::max(low[axis], 0.0);
      high[axis] = std::min(high[axis], double(grid_.size[axis] - 2));
      if (low[axis] > high[axis]) return false;
    }
    const Eigen::Vector3d normal = (index.col(1) - index.col(0))
                                       .cross(Eigen::Vector3d(index.col(2) - index.col(0)))
                                       .normalized();
    const double reach = normal.cwiseAbs().sum() / 2 + 1e-6;  // of a cell from its middle
    for (int k = int(low[2]); k <= int(high[2]); ++k)
      for (int j = int(low[1]); j <= int(high[1]); ++j)
        for (int i = int(low[0]); i <= int(high[0]); ++i) {
          const Eigen::Vector3d middle = Eigen::Vector3d(i, j, k).array() + 0.5;
          if (std::abs(normal.dot(middle - index.col(0))) > reach) continue;
          if (visit(i, j, k)) return true;
        }
    return false;
  }

  void set_at(const Triangles& surface, int triangle) {
    any_at(surface, triangle, [this](int i, int j, int k) {
      set(i, j, k);
      return false;
    });
  }

  bool is_any_at(const Triangles& surface, int triangle) const {
    return any_at(surface, triangle, *this);
  }

  /// Sets all cells next to set ones, corners included, n times. Cells at the border stay as they
  /// are.
  void dilate(int n) {
    for (int round = 0; round < n; ++round)
      for (int axis = 0; axis < 3; ++axis) dilate_along(axis);
  }

  void add(const Cells& others) {
    for (std::size_t at = 0; at < flags_.size(); ++at) flags_[at] |= others.flags_[at];
  }

  template <class Visit>
  void for_each(const Visit& visit) const {
    for (int k = 0; k + 1 < grid_.size[2]; ++k)
      for (int j = 0; j + 1 < grid_.size[1]; ++j)
        for (int i = 0; i + 1 < grid_.size[0]; ++i)
          if ((*this)(i, j, k)) visit(i, j, k);
  }

 private:
  void dilate_along(int axis) {
    const std::size_t stride = axis == 0   ? 1
                               : axis == 1 ? std::size_t(grid_.size[0])
                                           : std::size_t(grid_.size[0]) * grid_.size[1];
    const std::vector<std::uint8_t> before = flags_;
    for (std::size_t at = stride; at + stride < flags_.size(); ++at)
      flags_[at] |= before[at - stride] | before[at + stride];
  }

  const CubicGrid& grid_;
  std::vector<std::uint8_t> flags_;
};

/// What takes the place of some triangles.
struct Patch {
  std::vector<int> removed;                   // triangles, ascending
  std::vector<Vector<3>> points;              // new vertices
  std::vector<std::array<int, 3>> triangles;  // vertices of the surface, then the new ones
};

/// Directed sides of triangles that no other one runs through the other way, as closed polygons;
/// none where a vertex begins more than one of them.
template <class ForEachTriangle>
std::optional<std::vector<std::vector<int>>> rims(const ForEachTriangle& for_each_triangle,
                                                  std::vector<int>* crowded = nullptr) {
  std::unordered_map<std::uint64_t, int> sides;
  const auto key = [](int from, int to) {
    return std::uint64_t(std::uint32_t(from)) << 32 | std::uint32_t(to);
  };
  std::vector<std::pair<int, int>> in_order;
  for_each_triangle([&](const std::array<int, 3>& triangle) {
    for (int i = 0; i < 3; ++i) {
      const int from = triangle[i], to = triangle[(i + 1) % 3];
      ++sides[key(from, to)];
      in_order.emplace_back(from, to);
    }
  });
  std::map<int, int> next;
  bool is_crowded = false;
  for (const auto& [from, to] : in_order) {
    if (sides.contains(key(to, from))) continue;
    if (!next.emplace(from, to).second) {
      is_crowded = true;
      if (crowded) crowded->push_back(from);
    }
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

/// Plans the patch for a region of a surface.
class Region {
 public:
  enum class State { kFits, kFails, kWantsMore };

  Region(const Connected& surface, const std::vector<char>& is_event, double resolution)
      : surface_(surface.triangles),
        stars_(surface.stars),
        across_(surface.across),
        is_event_(is_event),
        h_(resolution),
        n_vertices_(static_cast<int>(surface_.points.rows())),
        is_removed_(surface_.elements.rows(), 0) {}

  /// @param events  triangles
  /// @param reach   [mm]; infinite: the whole components
  State plan(const std::vector<int>& events, double reach) {
    events_ = events;
    std::vector<int> near = std::isfinite(reach) ? neighbourhood(reach) : components();
    std::optional<Cells> cells, zone;
    for (bool is_complete = false; !is_complete;) {
      if (!make_grid(near)) return State::kFails;
      cells.emplace(grid_);
      zone.emplace(grid_);
      cover(near, *cells, *zone);
      remove(near, *cells);
      is_complete = !add_islands(near);
    }
    const WindingGrid winding(surface_.points, surface_.elements, grid_);
    inside_ = winding.inside();
    open_thin_parts(*zone, 0);
    open_thin_parts(*zone, 1);
    if (!march(*cells, winding)) return State::kFails;
    remove(near, *cells);
    if (const State state = remove_phantom_parts(); state != State::kFits) return state;
    return join() ? State::kFits : State::kFails;
  }

  const Patch& patch() const { return patch_; }
  /// Events of other regions that a phantom part of this one borders on, after kWantsMore; what
  /// else passes through the cells, after kFails.
  const std::vector<int>& wanted() const { return wanted_; }

 private:
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
      queue.push_back({t, centroid_of(surface_, t)});
    }
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const Reached from = queue[at];
      for (int i = 0; i < 3; ++i)
        for (const int t : stars_[surface_.elements(from.triangle, i)]) {
          if (is_reached[t] || (centroid_of(surface_, t) - from.source).norm() > reach) continue;
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
      for (int i = 0; i < 3; ++i) box.extend(corner(surface_, t, i));
    grid_.spacing = h_;
    const Eigen::Array3d first = (box.min().array() / h_ - kOffset).floor() - kPad;
    const Eigen::Array3d last = (box.max().array() / h_ - kOffset).ceil() + kPad;
    grid_.origin = (first + kOffset) * h_;
    if ((last - first + 1).prod() > double(kMostNodes)) return false;
    for (int axis = 0; axis < 3; ++axis) grid_.size[axis] = int(last[axis] - first[axis]) + 1;
    return true;
  }

  /// The cells of a region, and those where thin parts are removed.
  void cover(const std::vector<int>& near, Cells& cells, Cells& zone) const {
    for (const int t : near) cells.set_at(surface_, t);
    cells.dilate(1);
    for (const int t : events_) zone.set_at(surface_, t);
    Cells at_events = zone;
    zone.dilate(1);
    at_events.dilate(2);
    cells.add(at_events);
  }

  /// Nodes of the zone with the given flag that are in no cell of nodes with this flag only get
  /// the other one.
  void open_thin_parts(const Cells& zone, std::uint8_t flag) {
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
  bool march(Cells& cells, const WindingGrid& winding) {
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
      if (auto loops = rims(
              [this](const auto& visit) {
                for (const auto& triangle : grown_.triangles) visit(triangle);
              },
              &crowded)) {
        patch_rims_ = std::move(*loops);
        return true;
      }
      if (crowded.empty()) return false;
      for (const int vertex : crowded) add_cells_round(cells, vertex);
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

  void add_cells_round(Cells& cells, int vertex) const {
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
  void remove(const std::vector<int>& near, const Cells& cells) {
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
            std::minmax({corner(surface_, t, 0)[axis], corner(surface_, t, 1)[axis],
                         corner(surface_, t, 2)[axis]});
        is_far = most < low[axis] || least > high[axis];
      }
      if (!is_far) is_removed_[t] = cells.is_any_at(surface_, t);
    }
    core_.clear();
    for (int t = 0; t < surface_.elements.rows(); ++t)
      if (is_removed_[t]) core_.push_back(t);
    for (const int t : core_)
      for (int i = 0; i < 3; ++i) remove_star(surface_.elements(t, i));
    make_rims_simple();
  }

  /// Parts of the surface that the cells leave and the ring round them takes, or nearly: they join
  /// the region. True if there were any.
  bool add_islands(std::vector<int>& near) const {
    std::vector<char> is_seen(surface_.elements.rows(), 0);
    for (const int t : core_) is_seen[t] = 1;
    const std::size_t n_before = near.size();
    for (const int t : core_)
      for (int i = 0; i < 3; ++i) {
        const int start = across_(t, i);
        if (is_seen[start]) continue;
        std::vector<int> part = {start};
        is_seen[start] = 1;
        int n_left = 0;
        for (std::size_t at = 0; at < part.size(); ++at) {
          n_left += !is_removed_[part[at]];
          for (int side = 0; side < 3; ++side)
            if (const int next = across_(part[at], side); !is_seen[next]) {
              is_seen[next] = 1;
              part.push_back(next);
            }
        }
        if (n_left < kSmallestIsland) near.insert(near.end(), part.begin(), part.end());
      }
    return near.size() > n_before;
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
          area_normal(corner(surface_, t, 0), corner(surface_, t, 1), corner(surface_, t, 2))
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
    const auto surface_rims = rims([this](const auto& visit) {
      for (int t = 0; t < surface_.elements.rows(); ++t)
        if (is_removed_[t])
          visit({surface_.elements(t, 0), surface_.elements(t, 1), surface_.elements(t, 2)});
    });
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
    const double limit = 3 * kLongestEdge * h_;
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
    for (std::size_t p = 0; p < patch_rims_.size(); ++p) {
      if (is_taken[p]) continue;
      if (!is_short(patch_rims_[p])) return false;
      caps_.push_back(reversed(patch_rims_[p]));
    }
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
  std::vector<int> core_;                         // those in the cells
  Patch grown_;                                   // by marching cubes
  std::unordered_map<std::uint64_t, int> place_;  // vertices by grid edges
  std::vector<GridEdge> edges_of_;
  std::vector<char> is_loose_;  // of the new vertices: on no crossing
  std::vector<std::vector<int>> patch_rims_, caps_;
  Points<3> points_;  // of the surface, and the new ones
  Patch patch_;
};

/// One call of operate().
class Surgery {
 public:
  Surgery(TriMesh& mesh, std::vector<char> events, const SurgeryOptions& options,
          const BisectionHook& hook)
      : mesh_(mesh), options_(options), hook_(hook), h_(options.resolution_mm) {
    mesh_.add_property(is_event_);
    for (int t = 0; t < static_cast<int>(events.size()); ++t)
      mesh_.property(is_event_, FaceHandle(t)) = events[t];
  }
  ~Surgery() { mesh_.remove_property(is_event_); }
  Surgery(const Surgery&) = delete;
  Surgery& operator=(const Surgery&) = delete;

  SurgeryReport run() {
    refine_near_events();
    const Connected surface(mesh_);
    std::vector<char> is_event(surface.triangles.elements.rows());
    for (int t = 0; t < static_cast<int>(is_event.size()); ++t)
      is_event[t] = mesh_.property(is_event_, FaceHandle(t));
    make_clusters(surface, is_event);
    SurgeryReport report;
    constexpr int kRounds = 200;  // each enlarges or joins a cluster
    for (int round = 0; round < kRounds; ++round) {
      if (!plan(surface, is_event)) break;
      if (join_overlapping(surface)) continue;
      if (!enlarge_intersecting(surface, is_event)) {
        const std::vector<Cluster> refused = refuse_handles(surface);
        describe(surface, report.regions);
        apply(surface);
        if (!refused.empty()) report.refused = flags_of_events();
        return report;
      }
    }
    report.n_unresolved = static_cast<int>(
        std::count_if(clusters_.begin(), clusters_.end(),
                      [this](const Cluster& c) { return c.n_failures >= options_.max_attempts; }));
    report.n_unresolved = std::max(report.n_unresolved, 1);
    return report;
  }

 private:
  struct Cluster {
    std::vector<int> events;
    int n_failures = 0;
    bool is_planned = false;
    Patch patch;
  };

  double reach(const Cluster& cluster) const {
    return cluster.n_failures + 1 >= options_.max_attempts
               ? std::numeric_limits<double>::infinity()
               : kReach * h_ * std::pow(kGrowthOfReach, std::min(cluster.n_failures, kMostGrowths));
  }

  /// Alg. 11: faces near events get edges of the resolution's size.
  void refine_near_events() {
    constexpr int kRounds = 24;
    for (int round = 0; round < kRounds; ++round) {
      std::vector<Vector<3>> places;
      for (const FaceHandle face : mesh_.faces())
        if (mesh_.property(is_event_, face)) places.push_back(mesh_.calc_face_centroid(face));
      const Neighbourhood near(places, (kReach + kLongestEdge) * h_);
      std::vector<FaceHandle> marked;
      for (const FaceHandle face : mesh_.faces()) {
        double longest = 0;
        for (const auto side : mesh_.fh_range(face))
          longest = std::max(longest, mesh_.calc_edge_length(side));
        if (longest <= kLongestEdge * h_) continue;
        if (mesh_.property(is_event_, face) ||
            near.contains(mesh_.calc_face_centroid(face), longest))
          marked.push_back(face);
      }
      if (marked.empty()) return;
      bisect(mesh_, marked, hook_);
    }
  }

  /// Places by the cells of a coarse grid.
  class Neighbourhood {
   public:
    Neighbourhood(const std::vector<Vector<3>>& places, double reach) : reach_(reach) {
      for (const Vector<3>& place : places) cells_[cell_of(place)].push_back(place);
    }
    /// Whether a place lies within the reach, longer by some length.
    bool contains(const Vector<3>& at, double more) const {
      const double reach = reach_ + more;
      const std::array<int, 3> low = cell_of(at.array() - reach),
                               high = cell_of(at.array() + reach);
      if (std::size_t n =
              std::size_t(high[0] - low[0] + 1) * (high[1] - low[1] + 1) * (high[2] - low[2] + 1);
          n > cells_.size()) {
        for (const auto& [cell, places] : cells_)
          if (is_near(places, at, reach)) return true;
        return false;
      }
      for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
          for (int z = low[2]; z <= high[2]; ++z)
            if (const auto cell = cells_.find({x, y, z});
                cell != cells_.end() && is_near(cell->second, at, reach))
              return true;
      return false;
    }

   private:
    static bool is_near(const std::vector<Vector<3>>& places, const Vector<3>& at, double reach) {
      return std::any_of(places.begin(), places.end(), [&](const Vector<3>& place) {
        return (place - at).squaredNorm() <= reach * reach;
      });
    }
    std::array<int, 3> cell_of(const Vector<3>& at) const {
      const Eigen::Array3d cell = (at.array() / reach_).floor();
      return {int(cell[0]), int(cell[1]), int(cell[2])};
    }
    double reach_;
    std::map<std::array<int, 3>, std::vector<Vector<3>>> cells_;
  };

  /// Events whose regions may meet are one cluster.
  void make_clusters(const Connected& surface, const std::vector<char>& is_event) {
    const double cell = 2 * (kReach + 2 * kLongestEdge) * h_;
    std::map<std::array<int, 3>, int> number;  // of cells, in the order of their first events
    std::vector<std::array<int, 3>> cells;
    std::vector<std::pair<int, int>> event_cells;
    for (int t = 0; t < static_cast<int>(is_event.size()); ++t) {
      if (!is_event[t]) continue;
      const Eigen::Array3d at = (centroid_of(surface.triangles, t).array() / cell).floor();
      const std::array<int, 3> key = {int(at[0]), int(at[1]), int(at[2])};
      const auto [entry, is_new] = number.emplace(key, static_cast<int>(cells.size()));
      if (is_new) cells.push_back(key);
      event_cells.emplace_back(t, entry->second);
    }
    DisjointSets sets(cells.size());
    for (std::size_t c = 0; c < cells.size(); ++c)
      for (int k = 0; k < 27; ++k) {
        const auto other = number.find(
            {cells[c][0] + k % 3 - 1, cells[c][1] + k / 3 % 3 - 1, cells[c][2] + k / 9 - 1});
        if (other != number.end()) sets.join(static_cast<int>(c), other->second);
      }
    std::map<int, std::size_t> cluster_of;
    for (const auto& [t, c] : event_cells) {
      const auto [entry, is_new] = cluster_of.emplace(sets.find(c), clusters_.size());
      if (is_new) clusters_.emplace_back();
      clusters_[entry->second].events.push_back(t);
    }
  }

  /// Plans what has no plan yet; false if a cluster has failed too often.
  bool plan(const Connected& surface, std::vector<char>& is_event) {
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      Cluster& cluster = clusters_[c];
      while (!cluster.is_planned) {
        if (cluster.n_failures >= options_.max_attempts) return false;
        Region region(surface, is_event, h_);
        switch (region.plan(cluster.events, reach(cluster))) {
          case Region::State::kFits:
            cluster.patch = region.patch();
            cluster.is_planned = true;
            break;
          case Region::State::kFails:
            if (const bool is_whole = std::isinf(reach(cluster));
                !take_in(region.wanted(), cluster, is_event) || !is_whole)
              ++cluster.n_failures;
            break;
          case Region::State::kWantsMore:
            if (!join_owners(c, region.wanted())) ++cluster.n_failures;
            return plan(surface, is_event);
        }
      }
    }
    return true;
  }

  /// Triangles become events of a cluster; false if they are already.
  static bool take_in(const std::vector<int>& triangles, Cluster& cluster,
                      std::vector<char>& is_event) {
    const std::size_t n_before = cluster.events.size();
    for (const int t : triangles) {
      if (is_event[t]) continue;
      is_event[t] = 1;
      cluster.events.push_back(t);
    }
    std::sort(cluster.events.begin(), cluster.events.end());
    return cluster.events.size() > n_before;
  }

  /// Clusters of one set become one without a plan, at the place of the first. False if all sets
  /// have one cluster.
  bool join(DisjointSets& sets) {
    std::vector<Cluster> joined;
    std::map<int, std::size_t> place;
    const std::size_t n_before = clusters_.size();
    for (std::size_t c = 0; c < n_before; ++c) {
      const auto [entry, is_new] = place.emplace(sets.find(int(c)), joined.size());
      if (is_new) {
        joined.push_back(std::move(clusters_[c]));
        continue;
      }
      Cluster& into = joined[entry->second];
      into.events.insert(into.events.end(), clusters_[c].events.begin(), clusters_[c].events.end());
      std::sort(into.events.begin(), into.events.end());
      into.n_failures = std::max(into.n_failures, clusters_[c].n_failures);
      into.is_planned = false;
    }
    clusters_ = std::move(joined);
    return clusters_.size() < n_before;
  }

  /// Joins a cluster with those that own some events; false if there are none.
  bool join_owners(std::size_t c, const std::vector<int>& events) {
    DisjointSets sets(clusters_.size());
    for (std::size_t other = 0; other < clusters_.size(); ++other)
      for (const int t : events)
        if (std::binary_search(clusters_[other].events.begin(), clusters_[other].events.end(), t))
          sets.join(int(c), int(other));
    return join(sets);
  }

  /// Clusters that remove the same triangle, or triangles of one vertex, become one.
  bool join_overlapping(const Connected& surface) {
    DisjointSets sets(clusters_.size());
    std::unordered_map<int, std::size_t> owner;
    for (std::size_t c = 0; c < clusters_.size(); ++c)
      for (const int t : clusters_[c].patch.removed)
        for (int i = 0; i < 3; ++i) {
          const auto [entry, is_new] = owner.emplace(surface.triangles.elements(t, i), c);
          if (!is_new) sets.join(int(entry->second), int(c));
        }
    return join(sets);
  }

  /// The surface with all patches.
  struct Patched {
    Points<3> points;
    Elements<3> elements;
    std::vector<int> owner;  // cluster of each triangle, -1 for those that stay
    std::vector<int> kept;   // number of those that stay, which are the first ones
  };

  Patched patched(const Connected& surface) const {
    const Triangles& old = surface.triangles;
    std::vector<char> is_removed(old.elements.rows(), 0);
    std::size_t n_points = old.points.rows(), n_triangles = old.elements.rows();
    for (const Cluster& cluster : clusters_) {
      for (const int t : cluster.patch.removed) is_removed[t] = 1;
      n_points += cluster.patch.points.size();
      n_triangles += cluster.patch.triangles.size() - cluster.patch.removed.size();
    }
    Patched out;
    out.points.resize(static_cast<Eigen::Index>(n_points), 3);
    out.points.topRows(old.points.rows()) = old.points;
    out.elements.resize(static_cast<Eigen::Index>(n_triangles), 3);
    out.owner.assign(n_triangles, -1);
    Eigen::Index row = 0, point = old.points.rows();
    for (Eigen::Index t = 0; t < old.elements.rows(); ++t)
      if (!is_removed[t]) {
        out.elements.row(row++) = old.elements.row(t);
        out.kept.push_back(static_cast<int>(t));
      }
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      const Patch& patch = clusters_[c].patch;
      const int shift = static_cast<int>(point - old.points.rows());
      for (const auto& triangle : patch.triangles) {
        for (int i = 0; i < 3; ++i)
          out.elements(row, i) =
              triangle[i] < old.points.rows() ? triangle[i] : triangle[i] + shift;
        out.owner[row++] = static_cast<int>(c);
      }
      for (const Vector<3>& p : patch.points) out.points.row(point++) = p;
    }
    return out;
  }

  /// Clusters with a side that another triangle runs through the same way, or whose two ends are an
  /// edge of the rest already.
  void mark_crowded_edges(const Patched& all, std::vector<char>& is_bad) const {
    const auto key = [](int from, int to) {
      return std::uint64_t(std::uint32_t(from)) << 32 | std::uint32_t(to);
    };
    std::unordered_map<std::uint64_t, int> owner;
    for (Eigen::Index t = 0; t < all.elements.rows(); ++t)
      for (int i = 0; all.owner[t] >= 0 && i < 3; ++i)
        if (!owner.emplace(key(all.elements(t, i), all.elements(t, (i + 1) % 3)), all.owner[t])
                 .second)
          is_bad[all.owner[t]] = 1;
    for (Eigen::Index t = 0; t < all.elements.rows(); ++t)
      for (int i = 0; all.owner[t] < 0 && i < 3; ++i) {
        const auto at = owner.find(key(all.elements(t, i), all.elements(t, (i + 1) % 3)));
        if (at != owner.end()) is_bad[at->second] = 1;
      }
  }

  /// Whether a patch has triangles without area or that intersect others. It needs more reach, and
  /// what it intersects is too close to stay.
  bool enlarge_intersecting(const Connected& surface, std::vector<char>& is_event) {
    const Patched all = patched(surface);
    std::vector<char> is_new(all.owner.size());
    std::vector<char> is_bad(clusters_.size(), 0), has_more(clusters_.size(), 0);
    for (std::size_t t = 0; t < is_new.size(); ++t) {
      is_new[t] = all.owner[t] >= 0;
      if (!is_new[t]) continue;
      const Vector<3> a = all.points.row(all.elements(Eigen::Index(t), 0)),
                      b = all.points.row(all.elements(Eigen::Index(t), 1)),
                      c = all.points.row(all.elements(Eigen::Index(t), 2));
      if (!(area_normal(a, b, c).norm() > 1e-9 * h_ * h_)) is_bad[all.owner[t]] = 1;
    }
    mark_crowded_edges(all, is_bad);
    for (const auto& [a, b] : self_intersections(all.points, all.elements, is_new)) {
      for (const int t : {a, b})
        if (is_new[t]) is_bad[all.owner[t]] = 1;
      if (is_new[a] == is_new[b]) continue;
      const int old = all.kept[is_new[a] ? b : a];
      if (is_event[old]) continue;
      is_event[old] = has_more[all.owner[is_new[a] ? a : b]] = 1;
      clusters_[all.owner[is_new[a] ? a : b]].events.push_back(old);
    }
    bool is_any = false;
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      if (!is_bad[c]) continue;
      is_any = true;
      if (!has_more[c] || !std::isinf(reach(clusters_[c]))) ++clusters_[c].n_failures;
      clusters_[c].is_planned = false;
      std::sort(clusters_[c].events.begin(), clusters_[c].events.end());
    }
    return is_any;
  }

  /// Takes out clusters after which a shell's genus would be larger than allowed, one by one.
  std::vector<Cluster> refuse_handles(const Connected& surface) {
    std::vector<Cluster> all, refused;
    if (options_.max_genus == std::numeric_limits<int>::max()) return refused;
    all.swap(clusters_);
    for (Cluster& cluster : all) {
      clusters_.push_back(std::move(cluster));
      const Patched now = patched(surface);
      int genus = 0;
      for (const ComponentMeasures& shell : measure_components({now.points, now.elements}))
        genus = std::max(genus, shell.genus());
      if (genus <= options_.max_genus) continue;
      refused.push_back(std::move(clusters_.back()));
      clusters_.pop_back();
    }
    return refused;
  }

  std::vector<char> flags_of_events() const {
    std::vector<char> flags(mesh_.n_faces());
    for (int t = 0; t < static_cast<int>(flags.size()); ++t)
      flags[t] = mesh_.property(is_event_, FaceHandle(t));
    return flags;
  }

  void describe(const Connected& surface, std::vector<RebuiltRegion>& regions) const {
    const Patched all = patched(surface);
    Shells before(surface.triangles.points, surface.triangles.elements);
    Shells after(all.points, all.elements);
    std::vector<std::vector<int>> added(clusters_.size());
    for (int t = 0; t < static_cast<int>(all.owner.size()); ++t)
      if (all.owner[t] >= 0) added[all.owner[t]].push_back(t);
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      const Cluster& cluster = clusters_[c];
      RebuiltRegion& region = regions.emplace_back();
      region.place = Eigen::Vector3d::Zero();
      for (const int t : cluster.events) {
        region.place += centroid_of(surface.triangles, t);
        region.event_area_mm2 +=
            area_normal(corner(surface.triangles, t, 0), corner(surface.triangles, t, 1),
                        corner(surface.triangles, t, 2))
                .norm() /
            2;
      }
      region.place /= double(cluster.events.size());
      region.n_events = static_cast<int>(cluster.events.size());
      region.n_removed = static_cast<int>(cluster.patch.removed.size());
      region.n_added = static_cast<int>(cluster.patch.triangles.size());
      region.is_whole = std::isinf(reach(cluster));
      // Both parts have the same rim, so the reference point does not matter.
      region.volume_change_mm3 = enclosed(all.points, all.elements, added[c], region.place) -
                                 enclosed(surface.triangles.points, surface.triangles.elements,
                                          cluster.patch.removed, region.place);
      region.change =
          change(surface, cluster, before.of(cluster.patch.removed), after.of(added[c]), after);
    }
  }

  /// Components of a surface, and the volume of each.
  class Shells {
   public:
    Shells(const Points<3>& points, const Elements<3>& elements)
        : elements_(elements), sets_(points.rows()), volume_(points.rows(), 0.0) {
      for (const auto t : elements.rowwise()) {
        sets_.join(t[0], t[1]);
        sets_.join(t[0], t[2]);
      }
      for (Eigen::Index t = 0; t < elements.rows(); ++t) {
        const Vector<3> a = points.row(elements(t, 0)), b = points.row(elements(t, 1)),
                        c = points.row(elements(t, 2));
        volume_[sets_.find(elements(t, 0))] += a.cross(b).dot(c) / 6;
      }
    }
    /// Those of some triangles.
    std::set<int> of(const std::vector<int>& triangles) {
      std::set<int> out;
      for (const int t : triangles) out.insert(sets_.find(elements_(t, 0)));
      return out;
    }
    double volume(int shell) const { return volume_[shell]; }

   private:
    const Elements<3>& elements_;
    DisjointSets sets_;
    std::vector<double> volume_;
  };

  static double enclosed(const Points<3>& points, const Elements<3>& elements,
                         const std::vector<int>& triangles, const Vector<3>& reference) {
    double volume = 0;
    for (const int t : triangles) {
      const Vector<3> a = points.row(elements(t, 0)).transpose() - reference,
                      b = points.row(elements(t, 1)).transpose() - reference,
                      c = points.row(elements(t, 2)).transpose() - reference;
      volume += a.cross(b).dot(c) / 6;
    }
    return volume;
  }

  static TopologyChange change(const Connected& surface, const Cluster& cluster,
                               const std::set<int>& before, const std::set<int>& now,
                               const Shells& after) {
    if (now.empty()) return TopologyChange::kVanishing;
    if (now.size() > before.size()) {
      const bool has_cavity =
          std::any_of(now.begin(), now.end(), [&](int shell) { return after.volume(shell) < 0; });
      return has_cavity ? TopologyChange::kInsideOpening : TopologyChange::kSplitting;
    }
    if (now.size() < before.size()) return TopologyChange::kMerging;
    const int euler = euler_change(surface, cluster);
    if (euler == 0) return TopologyChange::kUntangling;
    return euler < 0 ? TopologyChange::kSelfMerging : TopologyChange::kHandleClosing;
  }

  /// Change of V - E + F. The rim stays, so that two more sides of triangles are one edge more.
  static int euler_change(const Connected& surface, const Cluster& cluster) {
    const Patch& patch = cluster.patch;
    std::unordered_map<int, int> n_removed;  // of each vertex
    for (const int t : patch.removed)
      for (int i = 0; i < 3; ++i) ++n_removed[surface.triangles.elements(t, i)];
    const auto n_gone = std::count_if(n_removed.begin(), n_removed.end(), [&](const auto& entry) {
      return std::size_t(entry.second) == surface.stars[entry.first].size();
    });
    const int new_faces = int(patch.triangles.size()) - int(patch.removed.size());
    return int(patch.points.size()) - int(n_gone) - new_faces / 2;
  }

  void apply(const Connected& surface) {
    for (const Cluster& cluster : clusters_)
      for (const int t : cluster.patch.removed) mesh_.delete_face(FaceHandle(t), false);
    std::vector<FaceHandle> added;
    const int n_old = static_cast<int>(surface.triangles.points.rows());
    for (const Cluster& cluster : clusters_) {
      const int first = static_cast<int>(mesh_.n_vertices());
      for (const Vector<3>& point : cluster.patch.points) mesh_.add_vertex(point);
      for (const auto& t : cluster.patch.triangles) {
        const auto handle = [&](int v) { return VertexHandle(v < n_old ? v : v - n_old + first); };
        const FaceHandle face = mesh_.add_face(handle(t[0]), handle(t[1]), handle(t[2]));
        if (!face.is_valid()) throw InvalidMesh("surgery: a patch is not a manifold");
        mesh_.property(is_event_, face) = 0;
        added.push_back(face);
      }
    }
    for (const VertexHandle vertex : mesh_.vertices())
      if (mesh_.is_isolated(vertex)) mesh_.delete_vertex(vertex, false);
    if (has_refinement_edges(mesh_)) mark_longest_edges(mesh_, added);
    collect_garbage(mesh_);
  }

  TriMesh& mesh_;
  const SurgeryOptions& options_;
  const BisectionHook& hook_;
  double h_;
  OpenMesh::FPropHandleT<char> is_event_;
  std::vector<Cluster> clusters_;
};

}  // namespace

std::string SurgeryOptions::error() const {
  if (!(resolution_mm > 0))
    return fmt::format("SurgeryOptions::resolution_mm = {} violates > 0", resolution_mm);
  if (max_attempts < 1)
    return fmt::format("SurgeryOptions::max_attempts = {} violates >= 1", max_attempts);
  return {};
}

std::string to_string(TopologyChange change) {
  switch (change) {
    case TopologyChange::kUntangling:
      return "untangling";
    case TopologyChange::kMerging:
      return "merging";
    case TopologyChange::kSelfMerging:
      return "self-merging";
    case TopologyChange::kHandleClosing:
      return "handle-closing";
    case TopologyChange::kSplitting:
      return "splitting";
    case TopologyChange::kInsideOpening:
      return "inside-opening";
    case TopologyChange::kVanishing:
      break;
  }
  return "vanishing";
}

SurgeryReport operate(TriMesh& mesh, std::vector<char> events, const SurgeryOptions& options,
                      const BisectionHook& hook) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  if (std::find(events.begin(), events.end(), 1) == events.end()) return {};
  return Surgery(mesh, std::move(events), options, hook).run();
}

}  // namespace surf::mesh
