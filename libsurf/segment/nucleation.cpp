#include "libsurf/segment/nucleation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/rasterize.h"

namespace surf::segment {
namespace {

constexpr int kLeastDepth = 3;  // voxels, along the axes

/// The voxels of a box, with the state of each.
class Lattice {
 public:
  Lattice(const Triangles& surface, const volume::Volume& volume) : volume_(volume) {
    Eigen::Array3d low = Eigen::Array3d::Constant(1e30), high = -low;
    for (const auto point : surface.points.rowwise()) {
      const Eigen::Array3d index = volume.world_to_index() * Vector<3>(point);
      low = low.min(index);
      high = high.max(index);
    }
    for (int axis = 0; axis < 3; ++axis) {
      lower_[axis] = int(std::floor(low[axis])) - 1;
      size_[axis] = int(std::ceil(high[axis])) + 2 - lower_[axis];
    }
    const Eigen::Affine3d to_world =
        volume.index_to_world() * Eigen::Translation3d(lower_[0], lower_[1], lower_[2]);
    inside_ = mesh::rasterize(surface, size_, to_world);
    depth_.assign(inside_.size(), 0);
  }

  std::size_t n() const { return inside_.size(); }
  bool is_inside(std::size_t at) const { return inside_[at] != 0; }
  std::array<int, 3> index(std::size_t at) const {
    return {int(at % size_[0]), int(at / size_[0] % size_[1]),
            int(at / (std::size_t(size_[0]) * size_[1]))};
  }
  Vector<3> position(std::size_t at) const {
    const auto [i, j, k] = index(at);
    return volume_.index_to_world() * Vector<3>(i + lower_[0], j + lower_[1], k + lower_[2]);
  }
  /// Calls visit(neighbour) for the six neighbours; the box has a border that is outside.
  template <class Visit>
  void for_neighbours(std::size_t at, const Visit& visit) const {
    const std::size_t stride[3] = {1, std::size_t(size_[0]), std::size_t(size_[0]) * size_[1]};
    const auto at_index = index(at);
    for (int axis = 0; axis < 3; ++axis) {
      if (at_index[axis] > 0) visit(at - stride[axis]);
      if (at_index[axis] + 1 < size_[axis]) visit(at + stride[axis]);
    }
  }
  /// Layers of neighbours to the next voxel that is not wanted; 0 where this one is not.
  std::vector<int>& depth() { return depth_; }

 private:
  const volume::Volume& volume_;
  std::array<int, 3> lower_, size_;
  std::vector<std::uint8_t> inside_;
  std::vector<int> depth_;
};

/// Flags voxels inside whose density is positive.
std::vector<char> unwanted_voxels(const Lattice& lattice, const energy::ShapeEnergy<3>& energy) {
  constexpr std::size_t kBatch = 1 << 16;
  std::vector<char> unwanted(lattice.n(), 0);
  std::vector<std::size_t> batch;
  const auto flush = [&] {
    Points<3> points(Eigen::Index(batch.size()), 3);
    for (std::size_t i = 0; i < batch.size(); ++i)
      points.row(Eigen::Index(i)) = lattice.position(batch[i]).transpose();
    Eigen::VectorXd density = Eigen::VectorXd::Zero(points.rows());
    energy.add_density(points, 1, density);
    for (std::size_t i = 0; i < batch.size(); ++i)
      unwanted[batch[i]] = density[Eigen::Index(i)] > 0;
    batch.clear();
  };
  for (std::size_t at = 0; at < lattice.n(); ++at) {
    if (lattice.is_inside(at)) batch.push_back(at);
    if (batch.size() == kBatch) flush();
  }
  if (!batch.empty()) flush();
  return unwanted;
}

/// A connected set of flagged voxels, from its first one; the flags are taken away. Empty if it
/// borders on the outside.
std::vector<std::size_t> enclosed_set(const Lattice& lattice, std::size_t first,
                                      std::vector<char>& flags) {
  std::vector<std::size_t> set = {first};
  flags[first] = 0;
  bool is_enclosed = true;
  for (std::size_t at = 0; at < set.size(); ++at)
    lattice.for_neighbours(set[at], [&](std::size_t next) {
      is_enclosed &= lattice.is_inside(next);
      if (!flags[next]) return;
      flags[next] = 0;
      set.push_back(next);
    });
  return is_enclosed ? set : std::vector<std::size_t>();
}

/// The voxel of a set that lies deepest in it, the first of equal ones, and its depth.
std::pair<std::size_t, int> deepest(Lattice& lattice, const std::vector<std::size_t>& set) {
  std::vector<int>& depth = lattice.depth();
  for (const std::size_t at : set) depth[at] = -1;  // not known yet
  std::vector<std::size_t> layer;
  for (const std::size_t at : set) {
    bool is_rim = false;
    lattice.for_neighbours(at, [&](std::size_t next) { is_rim |= depth[next] == 0; });
    if (is_rim) layer.push_back(at);
  }
  std::pair<std::size_t, int> out{set.front(), 0};
  for (int level = 1; !layer.empty(); ++level) {
    std::vector<std::size_t> inner;
    for (const std::size_t at : layer) depth[at] = level;
    out = {*std::min_element(layer.begin(), layer.end()), level};
    for (const std::size_t at : layer)
      lattice.for_neighbours(at, [&](std::size_t next) {
        if (depth[next] != -1) return;
        depth[next] = -2;
        inner.push_back(next);
      });
    layer = std::move(inner);
  }
  for (const std::size_t at : set) depth[at] = 0;
  return out;
}

}  // namespace

std::vector<Hole> find_holes(const Triangles& surface, const energy::ShapeEnergy<3>& energy,
                             const volume::Volume& volume) {
  Lattice lattice(surface, volume);
  std::vector<char> unwanted = unwanted_voxels(lattice, energy);
  const double spacing = volume.index_to_world().linear().colwise().norm().minCoeff();
  std::vector<Hole> holes;
  for (std::size_t at = 0; at < lattice.n(); ++at) {
    if (!unwanted[at]) continue;
    const std::vector<std::size_t> set = enclosed_set(lattice, at, unwanted);
    if (set.empty()) continue;
    const auto [place, depth] = deepest(lattice, set);
    if (depth < kLeastDepth) continue;
    // Layers of six neighbours are octahedra: the ball in one of n layers has n / sqrt(3).
    holes.push_back({lattice.position(place), (depth - 0.5) / std::sqrt(3.0) * spacing});
  }
  return holes;
}

int open_holes(Triangles& surface, const std::vector<Hole>& holes, double edge_length_mm,
               energy::ShapeEnergy<3>& energy) {
  int n_opened = 0;
  energy.reset({surface.points, surface.elements});
  double J = energy.value();
  for (const Hole& hole : holes) {
    const Triangles ball =
        mesh::ball(hole.center, hole.radius_mm, std::min(edge_length_mm, hole.radius_mm / 2));
    Triangles with = mesh::joined({surface, mesh::flipped(ball)});
    energy.reset({with.points, with.elements});
    if (energy.value() >= J) continue;
    J = energy.value();
    surface = std::move(with);
    ++n_opened;
  }
  energy.reset({surface.points, surface.elements});
  return n_opened;
}

}  // namespace surf::segment
