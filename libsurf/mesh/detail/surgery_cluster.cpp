#include "libsurf/mesh/detail/surgery_cluster.h"

#include <algorithm>
#include <compare>

namespace surf::mesh {

PatchedSurface patched(const ConnectedSurface& surface, const std::vector<Cluster>& clusters) {
  const Triangles& old = surface.triangles;
  std::vector<char> is_removed(old.elements.rows(), 0);
  std::size_t n_points = old.points.rows(), n_triangles = old.elements.rows();
  for (const Cluster& cluster : clusters) {
    for (const int t : cluster.patch.removed) is_removed[t] = 1;
    n_points += cluster.patch.points.size();
    n_triangles += cluster.patch.triangles.size() - cluster.patch.removed.size();
  }
  PatchedSurface out;
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
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Patch& patch = clusters[c].patch;
    const int shift = static_cast<int>(point - old.points.rows());
    for (const auto& triangle : patch.triangles) {
      for (int i = 0; i < 3; ++i)
        out.elements(row, i) = triangle[i] < old.points.rows() ? triangle[i] : triangle[i] + shift;
      out.owner[row++] = static_cast<int>(c);
    }
    for (const Vector<3>& p : patch.points) out.points.row(point++) = p;
  }
  return out;
}

void mark_crowded_edges(const PatchedSurface& all, std::vector<char>& is_bad) {
  struct OwnedSide {
    int from, to, owner;
    auto operator<=>(const OwnedSide&) const = default;
  };
  std::vector<OwnedSide> sides;  // of new triangles
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
      const auto at = std::lower_bound(sides.begin(), sides.end(), OwnedSide{from, to, -1});
      if (at != sides.end() && at->from == from && at->to == to) is_bad[at->owner] = 1;
    }
}

}  // namespace surf::mesh
