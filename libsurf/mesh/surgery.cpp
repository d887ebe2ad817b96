#include "libsurf/mesh/surgery.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>

#include "libsurf/base/error.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/detail/edge_uses.h"
#include "libsurf/mesh/detail/surgery_region.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::VertexHandle;

constexpr double kReach = 2;  // of a region along the surface, in units of the resolution
constexpr double kGrowthOfReach = 1.6;
constexpr int kMostGrowths = 3;
constexpr int kLocalGrowths = 4;  // of a patch that intersects others, before its reach grows

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
    const ConnectedSurface surface(mesh_);
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
    std::vector<int> others;  // see RegionRequest
    int n_failures = 0, n_growths = 0;
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
      const Neighbourhood near(places, (kReach + kLongestEdgeAtEvent) * h_);
      std::vector<FaceHandle> marked;
      for (const FaceHandle face : mesh_.faces()) {
        double longest = 0;
        for (const auto side : mesh_.fh_range(face))
          longest = std::max(longest, mesh_.calc_edge_length(side));
        if (longest <= kLongestEdgeAtEvent * h_) continue;
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
  void make_clusters(const ConnectedSurface& surface, const std::vector<char>& is_event) {
    const double cell = 2 * (kReach + 2 * kLongestEdgeAtEvent) * h_;
    std::map<std::array<int, 3>, int> number;  // of cells, in the order of their first events
    std::vector<std::array<int, 3>> cells;
    std::vector<std::pair<int, int>> event_cells;
    for (int t = 0; t < static_cast<int>(is_event.size()); ++t) {
      if (!is_event[t]) continue;
      const Eigen::Array3d at = (surface.centroid(t).array() / cell).floor();
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
  bool plan(const ConnectedSurface& surface, std::vector<char>& is_event) {
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      Cluster& cluster = clusters_[c];
      while (!cluster.is_planned) {
        if (cluster.n_failures >= options_.max_attempts) return false;
        RegionPlan plan_of_region =
            plan_region(surface, is_event, {cluster.events, cluster.others, reach(cluster)}, h_);
        switch (plan_of_region.state) {
          case RegionPlan::State::kFits:
            cluster.patch = std::move(plan_of_region.patch);
            cluster.is_planned = true;
            break;
          case RegionPlan::State::kFails:
            if (const bool is_whole = std::isinf(reach(cluster));
                !take_in(plan_of_region.wanted, cluster, is_event) || !is_whole)
              ++cluster.n_failures;
            break;
          case RegionPlan::State::kWantsMore:
            if (!join_owners(c, plan_of_region.wanted)) ++cluster.n_failures;
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
      into.others.insert(into.others.end(), clusters_[c].others.begin(), clusters_[c].others.end());
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
  bool join_overlapping(const ConnectedSurface& surface) {
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

  Patched patched(const ConnectedSurface& surface) const {
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
    struct Side {
      int from, to, owner;
      auto operator<=>(const Side&) const = default;
    };
    std::vector<Side> sides;  // of new triangles
    std::vector<char> is_used(all.points.rows(), 0);
    for (Eigen::Index t = 0; t < all.elements.rows(); ++t)
      for (int i = 0; all.owner[t] >= 0 && i < 3; ++i) {
        sides.push_back({all.elements(t, i), all.elements(t, (i + 1) % 3), all.owner[t]});
        is_used[all.elements(t, i)] = 1;
      }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 1; i < sides.size(); ++i)
      if (sides[i].from == sides[i - 1].from && sides[i].to == sides[i - 1].to)
        is_bad[sides[i].owner] = 1;
    for (Eigen::Index t = 0; t < all.elements.rows(); ++t)
      for (int i = 0; all.owner[t] < 0 && i < 3; ++i) {
        const int from = all.elements(t, i), to = all.elements(t, (i + 1) % 3);
        if (!is_used[from] || !is_used[to]) continue;
        const auto at = std::lower_bound(sides.begin(), sides.end(), Side{from, to, -1});
        if (at != sides.end() && at->from == from && at->to == to) is_bad[at->owner] = 1;
      }
  }

  /// Where a new triangle intersects others, the stars of its vertices on the old surface join the
  /// region. False if they have already.
  static bool grow_at(const ConnectedSurface& surface, const Eigen::Matrix<int, 1, 3>& triangle,
                      Cluster& cluster) {
    bool has_grown = false;
    for (const int vertex : triangle) {
      if (vertex >= surface.triangles.points.rows()) continue;
      for (const int t : surface.stars[vertex])
        if (std::find(cluster.others.begin(), cluster.others.end(), t) == cluster.others.end()) {
          cluster.others.push_back(t);
          has_grown = true;
        }
    }
    return has_grown;
  }

  /// Whether a patch has triangles without area or that intersect others. It needs more reach, and
  /// what it intersects is too close to stay.
  bool enlarge_intersecting(const ConnectedSurface& surface, std::vector<char>& is_event) {
    const Patched all = patched(surface);
    std::vector<char> is_new(all.owner.size());
    std::vector<char> is_bad(clusters_.size(), 0), has_more(clusters_.size(), 0),
        has_grown(clusters_.size(), 0);
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
      for (const int t : {a, b}) {
        if (!is_new[t]) continue;
        const int c = all.owner[t];
        is_bad[c] = 1;
        has_grown[c] |= grow_at(surface, all.elements.row(t), clusters_[c]);
      }
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
      const bool may_grow_again = has_grown[c] && ++clusters_[c].n_growths % kLocalGrowths != 0;
      if (!may_grow_again && (!has_more[c] || !std::isinf(reach(clusters_[c]))))
        ++clusters_[c].n_failures;
      clusters_[c].is_planned = false;
      std::sort(clusters_[c].events.begin(), clusters_[c].events.end());
    }
    return is_any;
  }

  /// Takes out clusters after which a shell's genus would be larger than allowed, one by one.
  std::vector<Cluster> refuse_handles(const ConnectedSurface& surface) {
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

  void describe(const ConnectedSurface& surface, std::vector<RebuiltRegion>& regions) const {
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
      for (const int t : cluster.events) region.place += surface.centroid(t);
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

  static TopologyChange change(const ConnectedSurface& surface, const Cluster& cluster,
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
  static int euler_change(const ConnectedSurface& surface, const Cluster& cluster) {
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

  void apply(const ConnectedSurface& surface) {
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

SurgeryReport operate(TriMesh& mesh, std::vector<char> events, const SurgeryOptions& options,
                      const BisectionHook& hook) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  if (std::find(events.begin(), events.end(), 1) == events.end()) return {};
  return Surgery(mesh, std::move(events), options, hook).run();
}

}  // namespace surf::mesh
