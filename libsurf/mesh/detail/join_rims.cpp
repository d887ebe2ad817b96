#include "libsurf/mesh/detail/join_rims.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/mesh/detail/annulus.h"

namespace surf::mesh {
namespace {

constexpr double kShortRim = 12;  // in units of the resolution
constexpr int kSmoothings = 6;    // of vertices that lie on no crossing
// Of a grown part's rims, below which it is a scrap: a piece of the plane with rims that may be
// capped has less than two.
constexpr int kTrianglesPerSide = 2;

/// The points of the surface, and the new ones.
Points<3> all_points(const Points<3>& points, const std::vector<Vector<3>>& grown) {
  Points<3> out(points.rows() + Eigen::Index(grown.size()), 3);
  out.topRows(points.rows()) = points;
  for (std::size_t i = 0; i < grown.size(); ++i)
    out.row(points.rows() + Eigen::Index(i)) = grown[i];
  return out;
}

/// Connected parts of what is removed, and of what has grown: sets of vertices.
DisjointSets connected_parts(const ConnectedSurface& surface, const TriangleFlags& is_removed,
                             const GrownPart& grown) {
  DisjointSets parts(surface.n_vertices() + grown.points.size());
  for (int t = 0; t < surface.n_triangles(); ++t)
    if (is_removed[t])
      for (int i = 1; i < 3; ++i) parts.join(surface.vertex(t, 0), surface.vertex(t, i));
  for (const auto& triangle : grown.triangles)
    for (int i = 1; i < 3; ++i) parts.join(triangle[0], triangle[i]);
  return parts;
}

/// A fan round a new vertex in the middle of a rim.
void add_cap(const Rim& rim, Points<3>& points, std::vector<std::array<int, 3>>& triangles) {
  const int middle = static_cast<int>(points.rows());
  points.conservativeResize(middle + 1, 3);
  Vector<3> sum = Vector<3>::Zero();
  for (const int v : rim) sum += points.row(v);
  points.row(middle) = sum / double(rim.size());
  for (std::size_t i = 0; i < rim.size(); ++i)
    triangles.push_back({rim[i], rim[(i + 1) % rim.size()], middle});
}

/// Vertices on no crossing move between their neighbours.
/// @param is_loose  of the first ones from first_new on; the others stay
void smooth_loose_vertices(const std::vector<std::array<int, 3>>& triangles, int first_new,
                           const std::vector<char>& is_loose, Points<3>& points) {
  const int end = first_new + static_cast<int>(is_loose.size());
  for (int round = 0; round < kSmoothings; ++round) {
    std::unordered_map<int, std::pair<Vector<3>, int>> sums;
    for (const auto& triangle : triangles)
      for (int i = 0; i < 3; ++i) {
        const int v = triangle[i];
        if (v < first_new || v >= end || !is_loose[v - first_new]) continue;
        auto& [sum, n] = sums.try_emplace(v, Vector<3>::Zero(), 0).first->second;
        sum += points.row(triangle[(i + 1) % 3]) + points.row(triangle[(i + 2) % 3]);
        n += 2;
      }
    for (const auto& [v, mean] : sums) points.row(v) = mean.first / mean.second;
  }
}

/// Numbers the new vertices that triangles use from first_new on.
/// @return their points
std::vector<Vector<3>> drop_unused(const Points<3>& points, int first_new,
                                   std::vector<std::array<int, 3>>& triangles) {
  std::vector<Vector<3>> out;
  std::unordered_map<int, int> number;
  for (auto& triangle : triangles)
    for (int& vertex : triangle) {
      if (vertex < first_new) continue;
      const auto [at, is_new] = number.emplace(vertex, first_new + int(out.size()));
      if (is_new) out.push_back(points.row(vertex));
      vertex = at->second;
    }
  return out;
}

/// Rims of the surface and of what has grown that a strip joins, and their parts.
struct Match {
  int part_of_surface, part_of_grown;
  const Rim *of_surface, *of_grown;
};

/// A rim that is closed by itself, as the sides of the triangles that stay run, and its part.
struct Cap {
  int part;
  Rim rim;
};

struct Matches {
  std::vector<Match> pairs;
  std::vector<Cap> caps;
};

class RimJoiner {
 public:
  RimJoiner(const ConnectedSurface& surface, const std::vector<int>& events,
            RemovedTriangles removal, GrownPart grown, double resolution)
      : surface_(surface),
        h_(resolution),
        is_removed_(std::move(removal.is_removed)),
        core_(std::move(removal.core)),
        grown_(std::move(grown)),
        points_(all_points(surface.triangles.points, grown_.points)),
        parts_(connected_parts(surface, is_removed_, grown_)),
        has_event_(points_.rows(), 0) {
    for (const int t : events) has_event_[part_of(t)] = 1;
  }

  JoinedRims join() {
    const auto surface_rims = rims(free_sides(surface_, is_removed_));
    if (!surface_rims) return {};
    auto matches = match(*surface_rims);
    if (!matches) return {std::nullopt, core_without_event()};
    if (!removes_shell_with_event(*surface_rims)) leave_alone_what_has_no_event(*matches);
    return {make_patch(*matches), {}};
  }

 private:
  int part_of(int triangle) { return parts_.find(surface_.vertex(triangle, 0)); }

  std::vector<int> core_without_event() {
    std::vector<int> out;
    for (const int t : core_)
      if (!has_event_[part_of(t)]) out.push_back(t);
    return out;
  }

  /// Each rim with the one that is closest; none if some rim has no partner.
  std::optional<Matches> match(const std::vector<Rim>& surface_rims) {
    Matches out;
    const double limit = 3 * longest_edge();
    std::vector<char> is_taken(grown_.rims.size(), 0);
    std::vector<char> is_free(points_.rows(), 0);  // parts without event with a rim of no partner
    for (const Rim& rim : surface_rims) {
      const std::optional<std::size_t> partner = closest(rim, limit);
      const int part = parts_.find(rim.front());
      if (!partner || is_taken[*partner]) {
        if (has_event_[part] && !is_short(rim)) return std::nullopt;
        if (has_event_[part])
          out.caps.push_back({part, rim});
        else
          is_free[part] = 1;
        continue;
      }
      is_taken[*partner] = 1;
      const Rim& of_grown = grown_.rims[*partner];
      out.pairs.push_back({part, parts_.find(of_grown.front()), &rim, &of_grown});
    }
    // What is left alone leaves its partners alone too.
    for (const Match& m : out.pairs)
      if (is_free[m.part_of_surface]) return std::nullopt;
    for (int t = 0; t < surface_.n_triangles(); ++t)
      if (is_removed_[t] && is_free[part_of(t)]) is_removed_[t] = 0;
    if (!cap_the_rest(is_taken, out)) return std::nullopt;
    return out;
  }

  /// Caps for the other rims of grown parts that are joined, and of those that are whole shells but
  /// for small holes. Other grown parts go: scraps where cells meet the surface by a corner. False
  /// if a rim is too long for a cap.
  bool cap_the_rest(const std::vector<char>& is_taken, Matches& matches) {
    std::vector<char> is_joined(points_.rows(), 0), has_rim(points_.rows(), 0);
    std::vector<int> n_triangles(points_.rows(), 0), n_sides(points_.rows(), 0);
    for (const Match& m : matches.pairs) is_joined[m.part_of_grown] = 1;
    for (const auto& triangle : grown_.triangles) ++n_triangles[parts_.find(triangle[0])];
    for (const Rim& rim : grown_.rims) {
      has_rim[parts_.find(rim.front())] = 1;
      n_sides[parts_.find(rim.front())] += static_cast<int>(rim.size());
    }
    const auto stays = [&](int part) {
      return is_joined[part] || n_triangles[part] > kTrianglesPerSide * n_sides[part];
    };
    for (std::size_t p = 0; p < grown_.rims.size(); ++p) {
      const Rim& rim = grown_.rims[p];
      if (is_taken[p]) continue;
      if (!is_short(rim)) return false;
      const int part = parts_.find(rim.front());
      if (stays(part)) matches.caps.push_back({part, reversed(rim)});
    }
    std::erase_if(grown_.triangles, [&](const auto& triangle) {
      const int part = parts_.find(triangle[0]);
      return has_rim[part] && !stays(part);
    });
    return true;
  }

  /// Of what is removed.
  double longest_edge() const {
    double longest = kLongestEdgeAtEvent * h_;
    for (int t = 0; t < surface_.n_triangles(); ++t)
      for (int i = 0; is_removed_[t] && i < 3; ++i)
        longest =
            std::max(longest, (surface_.corner(t, i) - surface_.corner(t, (i + 1) % 3)).norm());
    return longest;
  }

  /// The rim of what has grown with the least distance below the limit.
  std::optional<std::size_t> closest(const Rim& rim, double limit) const {
    double best = limit;
    std::optional<std::size_t> out;
    for (std::size_t p = 0; p < grown_.rims.size(); ++p) {
      const double gap =
          std::max(largest_gap(rim, grown_.rims[p]), largest_gap(grown_.rims[p], rim));
      if (gap < best) best = gap, out = p;
    }
    return out;
  }

  /// Of a neck that is too thin for the grid: it may be capped.
  bool is_short(const Rim& rim) const {
    double length = 0;
    for (std::size_t i = 0; i < rim.size(); ++i)
      length += (points_.row(rim[i]) - points_.row(rim[(i + 1) % rim.size()])).norm();
    return length < kShortRim * h_;
  }

  /// Largest distance of a vertex of one polygon to the nearest one of the other.
  double largest_gap(const Rim& from, const Rim& to) const {
    double largest = 0;
    for (const int v : from) {
      double least = std::numeric_limits<double>::infinity();
      for (const int w : to)
        least = std::min(least, (points_.row(v) - points_.row(w)).squaredNorm());
      largest = std::max(largest, least);
    }
    return std::sqrt(largest);
  }

  /// Whether a part with an event has no rim, being removed whole. What has grown for it may be
  /// joined to any sheet then.
  bool removes_shell_with_event(const std::vector<Rim>& surface_rims) {
    std::vector<char> has_rim(points_.rows(), 0);
    for (const Rim& rim : surface_rims) has_rim[parts_.find(rim.front())] = 1;
    for (int t = 0; t < surface_.n_triangles(); ++t)
      if (is_removed_[t] && has_event_[part_of(t)] && !has_rim[part_of(t)]) return true;
    return false;
  }

  /// Sheets that pass through the cells without an event keep their triangles.
  void leave_alone_what_has_no_event(Matches& matches) {
    std::vector<Match>& pairs = matches.pairs;
    DisjointSets joined(points_.rows());
    for (const Match& m : pairs) joined.join(m.part_of_surface, m.part_of_grown);
    std::vector<char> is_alive(points_.rows(), 0);
    for (int part = 0; part < points_.rows(); ++part)
      if (has_event_[part]) is_alive[joined.find(part)] = 1;
    const auto is_dead = [&](int part) { return !is_alive[joined.find(part)]; };
    std::vector<char> is_matched(points_.rows(), 0);
    for (const Match& m : pairs) is_matched[m.part_of_surface] = is_matched[m.part_of_grown] = 1;
    for (int t = 0; t < surface_.n_triangles(); ++t) {
      if (!is_removed_[t]) continue;
      const int part = part_of(t);
      if (is_matched[part] && is_dead(part)) is_removed_[t] = 0;
    }
    std::erase_if(grown_.triangles, [&](const auto& triangle) {
      const int part = parts_.find(triangle[0]);
      return is_matched[part] && is_dead(part);
    });
    std::erase_if(matches.caps,
                  [&](const Cap& cap) { return is_matched[cap.part] && is_dead(cap.part); });
    std::erase_if(pairs, [&](const Match& m) { return is_dead(m.part_of_surface); });
  }

  Patch make_patch(const Matches& matches) {
    Patch out;
    for (int t = 0; t < surface_.n_triangles(); ++t)
      if (is_removed_[t]) out.removed.push_back(t);
    out.triangles = std::move(grown_.triangles);
    // The grown rim's sides run as its triangles do; the strip's run the other way.
    for (const Match& m : matches.pairs) {
      const auto strip = annulus(points_, *m.of_surface, reversed(*m.of_grown));
      out.triangles.insert(out.triangles.end(), strip.begin(), strip.end());
    }
    for (const Cap& cap : matches.caps) add_cap(cap.rim, points_, out.triangles);
    smooth_loose_vertices(out.triangles, surface_.n_vertices(), grown_.is_loose, points_);
    out.points = drop_unused(points_, surface_.n_vertices(), out.triangles);
    return out;
  }

  const ConnectedSurface& surface_;
  double h_;
  TriangleFlags is_removed_;
  std::vector<int> core_;
  GrownPart grown_;
  Points<3> points_;             // of the surface, and the new ones
  DisjointSets parts_;           // of what is removed, and of what has grown
  std::vector<char> has_event_;  // of the parts
};

}  // namespace

JoinedRims join_rims(const ConnectedSurface& surface, const std::vector<int>& events,
                     RemovedTriangles removal, GrownPart part, double resolution_mm) {
  return RimJoiner(surface, events, std::move(removal), std::move(part), resolution_mm).join();
}

}  // namespace surf::mesh
