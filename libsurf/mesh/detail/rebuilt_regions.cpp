#include "libsurf/mesh/detail/rebuilt_regions.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "libsurf/base/disjoint_sets.h"
#include "libsurf/base/products.h"

namespace surf::mesh {
namespace {

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
      // About a point of its own, so that a shell far from the world's origin loses no digits.
      const int shell = sets_.find(elements(t, 0));
      const Vector<3> base = points.row(shell), a = points.row(elements(t, 0)),
                      b = points.row(elements(t, 1)), c = points.row(elements(t, 2));
      volume_[shell] += triple(a - base, b - base, c - base) / 6;
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

double enclosed(const Points<3>& points, const Elements<3>& elements,
                const std::vector<int>& triangles, const Vector<3>& reference) {
  double volume = 0;
  for (const int t : triangles) {
    const Vector<3> a = points.row(elements(t, 0)).transpose() - reference,
                    b = points.row(elements(t, 1)).transpose() - reference,
                    c = points.row(elements(t, 2)).transpose() - reference;
    volume += triple(a, b, c) / 6;
  }
  return volume;
}

/// Change of V - E + F. The rim stays, so that two more sides of triangles are one edge more.
int euler_change(const ConnectedSurface& surface, const Cluster& cluster) {
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

TopologyChange change(const ConnectedSurface& surface, const Cluster& cluster,
                      const std::set<int>& before, const std::set<int>& now, const Shells& after) {
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

}  // namespace

std::vector<RebuiltRegion> rebuilt_regions(const ConnectedSurface& surface,
                                           const std::vector<Cluster>& clusters) {
  const PatchedSurface all = patched(surface, clusters);
  std::vector<RebuiltRegion> regions;
  Shells before(surface.triangles.points, surface.triangles.elements);
  Shells after(all.points, all.elements);
  std::vector<std::vector<int>> added(clusters.size());
  for (int t = 0; t < static_cast<int>(all.owner.size()); ++t)
    if (all.owner[t] >= 0) added[all.owner[t]].push_back(t);
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Cluster& cluster = clusters[c];
    RebuiltRegion& region = regions.emplace_back();
    region.place = Eigen::Vector3d::Zero();
    for (const int t : cluster.events) region.place += surface.centroid(t);
    region.place /= double(cluster.events.size());
    region.n_events = static_cast<int>(cluster.events.size());
    region.n_removed = static_cast<int>(cluster.patch.removed.size());
    region.n_added = static_cast<int>(cluster.patch.triangles.size());
    // Both parts have the same rim, so the reference point does not matter.
    region.volume_change_mm3 = enclosed(all.points, all.elements, added[c], region.place) -
                               enclosed(surface.triangles.points, surface.triangles.elements,
                                        cluster.patch.removed, region.place);
    region.change =
        change(surface, cluster, before.of(cluster.patch.removed), after.of(added[c]), after);
  }
  return regions;
}

}  // namespace surf::mesh
