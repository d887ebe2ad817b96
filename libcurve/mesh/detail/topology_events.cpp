#include "libcurve/mesh/detail/topology_events.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

struct Cluster {
  Vector<2> sum = Vector<2>::Zero();
  int n = 0;
  double change = 0;        ///< of the enclosed area
  std::vector<int> ending;  ///< kept runs that end here, before or after
  Vector<2> place() const { return sum / std::max(n, 1); }
};

flow::TopologyChange kind(const std::vector<int>& before, const std::vector<int>& after) {
  const auto n_outer = std::count(before.begin(), before.end(), 1);
  using enum flow::TopologyChange;
  if (after.empty()) return kVanishing;
  if (after.size() < before.size())
    return n_outer == 0 || n_outer == Eigen::Index(before.size()) ? kMerging : kInsideOpening;
  if (after.size() > before.size()) {
    const bool is_mixed =
        std::count(after.begin(), after.end(), after[0]) != Eigen::Index(after.size());
    return is_mixed ? kSelfMerging : kSplitting;
  }
  return kSelfCrossing;
}

class Events {
 public:
  Events(const Segments& curves, const BoundaryRuns& boundary, int n_real, double scale,
         double crumb)
      : curves_(curves),
        boundary_(boundary),
        graph_(boundary.graph()),
        runs_(boundary.runs()),
        n_real_(n_real),
        scale_(scale),
        crumb_(crumb) {}

  std::vector<flow::TopologyEvent> events() {
    if (std::all_of(runs_.begin(), runs_.end(), [](const Run& run) { return run.is_loop; }))
      return {};
    const Vector<2> origin = curves_.points.row(0);
    std::vector<double> area(runs_.size());
    for (std::size_t r = 0; r < runs_.size(); ++r) area[r] = run_area(runs_[r], origin);
    const std::vector<int> before = permutation_before(), after = permutation_after();
    std::map<int, Cluster> clusters = find_clusters(area, before, after);
    std::vector<int> current = before;
    for (std::size_t r = 0; r < runs_.size(); ++r)
      if (before[r] >= 0 && !runs_[r].is_loop)
        clusters[cluster_at(runs_[r].to)].ending.push_back(int(r));
    std::vector<flow::TopologyEvent> out;
    std::vector<const Cluster*> in_order;
    for (const auto& [vertex, cluster] : clusters) in_order.push_back(&cluster);
    std::sort(in_order.begin(), in_order.end(), [](const Cluster* a, const Cluster* b) {
      return std::make_pair(a->place()[0], a->place()[1]) <
             std::make_pair(b->place()[0], b->place()[1]);
    });
    for (const Cluster* cluster : in_order) {
      const auto old_cycles = cycles(current, cluster->ending, area);
      for (const int r : cluster->ending) current[r] = after[r];
      const auto new_cycles = cycles(current, cluster->ending, area);
      flow::TopologyEvent event;
      event.kind = kind(old_cycles, new_cycles);
      event.place << cluster->place(), 0;
      event.enclosed_change = cluster->change;
      out.push_back(event);
    }
    return out;
  }

 private:
  double run_length(const Run& run) const {
    double sum = 0;
    for (const int p : run.pieces) sum += boundary_.length(p);
    return sum;
  }
  /// Twice the area between a run and the origin.
  double run_area(const Run& run, const Vector<2>& origin) const {
    double sum = 0;
    for (const int p : run.pieces)
      sum += cross(graph_.rounded(boundary_.piece(p).from) - origin,
                   graph_.rounded(boundary_.piece(p).to) - origin);
    return sum;
  }

  std::map<int, Cluster> find_clusters(const std::vector<double>& area,
                                       const std::vector<int>& before,
                                       const std::vector<int>& after) {
    DisjointSets sets(graph_.n_vertices());
    for (const Run& run : runs_)
      if (!run.is_loop && (!run.is_kept || !run.is_real || run_length(run) < scale_))
        sets.join(run.from, run.to);
    for (std::size_t r = 0; r < runs_.size(); ++r)
      for (const int next : {before[r], after[r]})
        if (next >= 0) sets.join(runs_[r].to, runs_[next].from);
    cluster_of_.resize(graph_.n_vertices());
    for (int v = 0; v < graph_.n_vertices(); ++v) cluster_of_[v] = sets.find(v);
    std::map<int, Cluster> out;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (runs_[r].is_loop) continue;
      for (const int vertex : {runs_[r].from, runs_[r].to}) {
        Cluster& cluster = out[cluster_at(vertex)];
        cluster.sum += graph_.rounded(vertex);
        ++cluster.n;
      }
      double& change = out[cluster_at(runs_[r].to)].change;
      const int winding = boundary_.piece(runs_[r].pieces[0]).winding;
      if (!runs_[r].is_real) change += runs_[r].is_kept ? area[r] / 2 : 0;
      if (runs_[r].is_real) change += (runs_[r].is_kept ? 1 - winding : -winding) * area[r] / 2;
    }
    return out;
  }

  int cluster_at(int vertex) const { return cluster_of_[vertex]; }

  /// Of the kept runs of curves: which came next along the old curves.
  std::vector<int> permutation_before() const {
    std::vector<int> out(runs_.size(), -1);
    std::vector<int> starting(curves_.points.rows(), -1);
    for (int e = 0; e < n_real_; ++e) starting[curves_.elements(e, 0)] = e;
    std::vector<char> is_done(n_real_, 0), is_placed(runs_.size(), 0);
    for (int first = 0; first < n_real_; ++first) {
      std::vector<int> sequence;
      for (int e = first; !is_done[e]; e = starting[curves_.elements(e, 1)]) {
        is_done[e] = 1;
        for (const int p : graph_.along(e)) {
          if (p < 0 || !runs_[boundary_.run_of(p)].is_kept || is_placed[boundary_.run_of(p)])
            continue;
          is_placed[boundary_.run_of(p)] = 1;
          sequence.push_back(boundary_.run_of(p));
        }
      }
      for (std::size_t k = 0; k < sequence.size(); ++k)
        out[sequence[k]] = sequence[(k + 1) % sequence.size()];
    }
    for (std::size_t r = 0; r < runs_.size(); ++r)  // only where bridges lie on curves
      if (runs_[r].is_kept && runs_[r].is_real && !is_placed[r]) out[r] = int(r);
    return out;
  }

  /// Which comes next along the new ones.
  std::vector<int> permutation_after() const {
    std::vector<int> out(runs_.size(), -1);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      if (!runs_[r].is_kept || !runs_[r].is_real) continue;
      int next = boundary_.next(int(r));
      while (!runs_[next].is_real) next = boundary_.next(next);
      out[r] = next;
    }
    return out;
  }

  /// Signs of the areas of the cycles through these runs, gaps closed by straight lines; without
  /// crumbs.
  std::vector<int> cycles(const std::vector<int>& next, const std::vector<int>& through,
                          const std::vector<double>& area) const {
    const Vector<2> origin = curves_.points.row(0);
    std::vector<int> out;
    std::set<int> left(through.begin(), through.end());
    while (!left.empty()) {
      const int first = *left.begin();
      double sum = 0;
      int r = first;
      do {
        left.erase(r);
        sum += area[r] + cross(graph_.rounded(runs_[r].to) - origin,
                               graph_.rounded(runs_[next[r]].from) - origin);
        r = next[r];
      } while (r != first);
      if (std::abs(sum) / 2 >= crumb_) out.push_back(sum > 0 ? 1 : -1);
    }
    return out;
  }

  const Segments& curves_;
  const BoundaryRuns& boundary_;
  const PlanarPieces& graph_;
  const std::vector<Run>& runs_;
  const int n_real_;
  const double scale_, crumb_;
  std::vector<int> cluster_of_;  // of each vertex
};

}  // namespace

std::vector<flow::TopologyEvent> topology_events(const Segments& curves, const BoundaryRuns& runs,
                                                 int n_real, double scale, double crumb) {
  return Events(curves, runs, n_real, scale, crumb).events();
}

}  // namespace surf::curve
