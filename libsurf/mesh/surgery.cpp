#include "libsurf/mesh/surgery.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <OpenMesh/Core/Utils/PropertyManager.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/base/error.h"
#include "libsurf/base/threads.h"
#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/detail/event_refinement.h"
#include "libsurf/mesh/detail/rebuilt_regions.h"
#include "libsurf/mesh/detail/surgery_cluster.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/self_intersections.h"
#include "libsurf/mesh/triangle_shape.h"

namespace surf::mesh {
namespace {

constexpr double kGrowthOfReach = 1.6;
constexpr int kMostGrowths = 3;
constexpr int kAheadPerThread = 2;
constexpr int kLocalGrowths = 4;  // of a patch that intersects others, before its reach grows

/// One call of operate().
class Surgery {
 public:
  Surgery(TriMesh& mesh, std::vector<char> events, const SurgeryOptions& options,
          const BisectionHook& hook)
      : mesh_(mesh), options_(options), hook_(hook), h_(options.resolution_mm), is_event_(mesh) {
    for (int t = 0; t < static_cast<int>(events.size()); ++t) is_event_[FaceHandle(t)] = events[t];
  }

  SurgeryReport run() {
    refine_near_events(mesh_, is_event_, h_, hook_);
    const ConnectedSurface surface(mesh_);
    std::vector<char> is_event(surface.triangles.elements.rows());
    for (int t = 0; t < static_cast<int>(is_event.size()); ++t)
      is_event[t] = is_event_[FaceHandle(t)];
    make_clusters(surface, is_event);
    LargeParts large(surface, is_event);
    SurgeryReport report;
    constexpr int kRounds = 200;  // each enlarges or joins a cluster
    for (int round = 0; round < kRounds; ++round) {
      if (!plan(surface, large, is_event)) break;
      if (join_overlapping(surface)) continue;
      if (!enlarge_intersecting(surface, is_event)) {
        const std::vector<Cluster> refused = refuse_handles(surface);
        report.regions = rebuilt_regions(surface, clusters_);
        for (std::size_t c = 0; c < clusters_.size(); ++c)
          report.regions[c].is_whole = std::isinf(reach(clusters_[c]));
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
  double reach(const Cluster& cluster) const {
    return cluster.n_failures + 1 >= options_.max_attempts
               ? std::numeric_limits<double>::infinity()
               : kReach * h_ * std::pow(kGrowthOfReach, std::min(cluster.n_failures, kMostGrowths));
  }

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

  RegionPlan plan_of(const Cluster& cluster, const ConnectedSurface& surface, LargeParts& large,
                     const std::vector<char>& is_event) const {
    return plan_region(surface, large, is_event, {cluster.events, cluster.others, reach(cluster)},
                       h_);
  }

  /// The next clusters without a plan, side by side ahead of their turns: a few, since what one of
  /// them takes in makes the plans of all others stale.
  void plan_ahead(std::size_t first, const ConnectedSurface& surface, LargeParts& large,
                  const std::vector<char>& is_event) {
    if (is_on_one_thread()) return;
    const auto n_wanted = std::size_t(kAheadPerThread * tbb::this_task_arena::max_concurrency());
    std::vector<Cluster*> next;
    for (std::size_t c = first; c < clusters_.size() && next.size() < n_wanted; ++c)
      if (!clusters_[c].is_planned && !clusters_[c].ahead &&
          clusters_[c].n_failures < options_.max_attempts)
        next.push_back(&clusters_[c]);
    tbb::parallel_for(std::size_t(0), next.size(), [&](std::size_t n) {
      next[n]->ahead = plan_of(*next[n], surface, large, is_event);
    });
  }

  /// Plans what has no plan yet; false if a cluster has failed too often. Plans that were made
  /// before there were other events are made anew.
  bool plan(const ConnectedSurface& surface, LargeParts& large, std::vector<char>& is_event) {
    for (std::size_t c = 0; c < clusters_.size(); ++c) {
      Cluster& cluster = clusters_[c];
      if (!cluster.is_planned && !cluster.ahead) plan_ahead(c, surface, large, is_event);
      while (!cluster.is_planned) {
        if (cluster.n_failures >= options_.max_attempts) return false;
        RegionPlan plan_of_region =
            cluster.ahead ? std::move(*cluster.ahead) : plan_of(cluster, surface, large, is_event);
        cluster.ahead.reset();
        switch (plan_of_region.state) {
          case RegionPlan::State::kFits:
            cluster.patch = std::move(plan_of_region.patch);
            cluster.is_planned = true;
            break;
          case RegionPlan::State::kFails:
            if (plan_of_region.is_large && !std::isinf(reach(cluster)))
              cluster.n_failures = options_.max_attempts - 1;
            else if (const double failed = reach(cluster);
                     take_in(plan_of_region.wanted, cluster, is_event)) {
              if (!std::isinf(failed)) ++cluster.n_failures;
              for (Cluster& each : clusters_) each.ahead.reset();
            } else {
              // The same again would fail again: on to another reach.
              do ++cluster.n_failures;
              while (reach(cluster) == failed && cluster.n_failures < options_.max_attempts);
            }
            break;
          case RegionPlan::State::kWantsMore:
            if (!join_owners(c, plan_of_region.wanted)) ++cluster.n_failures;
            return plan(surface, large, is_event);
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
      into.ahead.reset();
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
    const PatchedSurface all = patched(surface, clusters_);
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

  /// Handles beyond the most that a shell may have, of all shells.
  int n_excess_handles(const Triangles& surface) const {
    int n = 0;
    for (const ComponentMeasures& shell : measure_components(surface))
      n += std::max(0, shell.genus() - options_.max_genus);
    return n;
  }

  /// Takes out clusters that would give a shell more handles than allowed, one by one.
  std::vector<Cluster> refuse_handles(const ConnectedSurface& surface) {
    std::vector<Cluster> all, refused;
    if (options_.max_genus == std::numeric_limits<int>::max()) return refused;
    int n_before = n_excess_handles(surface.triangles);
    all.swap(clusters_);
    for (Cluster& cluster : all) {
      clusters_.push_back(std::move(cluster));
      const PatchedSurface now = patched(surface, clusters_);
      const int n_now = n_excess_handles({now.points, now.elements});
      if (n_now <= n_before) {
        n_before = n_now;
        continue;
      }
      refused.push_back(std::move(clusters_.back()));
      clusters_.pop_back();
    }
    return refused;
  }

  std::vector<char> flags_of_events() const {
    std::vector<char> flags(mesh_.n_faces());
    for (int t = 0; t < static_cast<int>(flags.size()); ++t) flags[t] = is_event_[FaceHandle(t)];
    return flags;
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
        is_event_[face] = 0;
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
  OpenMesh::FProp<char> is_event_;
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
