#include "libsurf/mesh/detail/event_refinement.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "libsurf/mesh/detail/surgery_region.h"

namespace surf::mesh {
namespace {

/// Places by the cells of a coarse grid.
class Neighbourhood {
 public:
  Neighbourhood(const std::vector<Vector<3>>& places, double reach) : reach_(reach) {
    for (const Vector<3>& place : places) cells_[cell_of(place)].push_back(place);
  }
  /// Whether a place lies within the reach, longer by some length.
  bool contains(const Vector<3>& at, double more) const {
    const double reach = reach_ + more;
    const std::array<int, 3> low = cell_of(at.array() - reach), high = cell_of(at.array() + reach);
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

}  // namespace

void refine_near_events(TriMesh& mesh, const OpenMesh::FProp<char>& is_event, double h,
                        const BisectionHook& hook) {
  constexpr int kRounds = 24;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vector<3>> places;
    for (const FaceHandle face : mesh.faces())
      if (is_event[face]) places.push_back(mesh.calc_face_centroid(face));
    const Neighbourhood near(places, (kReach + kLongestEdgeAtEvent) * h);
    std::vector<FaceHandle> marked;
    for (const FaceHandle face : mesh.faces()) {
      double longest = 0;
      for (const auto side : mesh.fh_range(face))
        longest = std::max(longest, mesh.calc_edge_length(side));
      if (longest <= kLongestEdgeAtEvent * h) continue;
      if (is_event[face] || near.contains(mesh.calc_face_centroid(face), longest))
        marked.push_back(face);
    }
    if (marked.empty()) return;
    bisect(mesh, marked, hook);
  }
}

}  // namespace surf::mesh
