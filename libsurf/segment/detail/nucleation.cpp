#include "libsurf/segment/detail/nucleation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "libsurf/base/index_box.h"

namespace surf::segment {
namespace {

constexpr int kLeastDepth = 3;  // cells, along the axes

/// The cells of a box round a shape, with the state of each.
template <int Dim>
class Lattice {
 public:
  Lattice(const Setting<Dim>& setting, const Simplices<Dim>& shape) : extent_(setting.extent()) {
    Vector<Dim> low = Vector<Dim>::Constant(1e30), high = -low;
    for (const auto point : shape.points.rowwise()) {
      const Vector<Dim> index = extent_.world_to_index * Vector<Dim>(point);
      low = low.cwiseMin(index);
      high = high.cwiseMax(index);
    }
    Vector<Dim> first;
    for (int axis = 0; axis < Dim; ++axis) {
      box_.lower[axis] = int(std::floor(low[axis])) - 1;
      box_.size[axis] = int(std::ceil(high[axis])) + 2 - box_.lower[axis];
      first[axis] = box_.lower[axis];
    }
    inside_ = setting.rasterized(shape, box_.size,
                                 extent_.index_to_world * Eigen::Translation<double, Dim>(first));
    depth_.assign(inside_.size(), 0);
  }

  std::size_t n() const { return inside_.size(); }
  bool is_inside(std::size_t at) const { return inside_[at] != 0; }
  Vector<Dim> position(std::size_t at) const {
    const auto here = box_.node(at);
    Vector<Dim> out;
    for (int axis = 0; axis < Dim; ++axis) out[axis] = here[axis];
    return extent_.index_to_world * out;
  }
  /// Calls visit(neighbour) for the neighbours along the axes; the box has a border that is
  /// outside.
  template <class Visit>
  void for_neighbours(std::size_t at, const Visit& visit) const {
    box_.for_neighbours(at, visit);
  }
  /// Layers of neighbours to the next cell that is not wanted; 0 where this one is not.
  std::vector<int>& depth() { return depth_; }

 private:
  const ImageExtent<Dim>& extent_;
  IndexBox<Dim> box_;
  std::vector<std::uint8_t> inside_;
  std::vector<int> depth_;
};

/// Flags cells inside whose density is positive.
template <int Dim>
std::vector<char> unwanted_cells(const Lattice<Dim>& lattice,
                                 const energy::ShapeEnergy<Dim>& energy) {
  constexpr std::size_t kBatch = 1 << 16;
  std::vector<char> unwanted(lattice.n(), 0);
  std::vector<std::size_t> batch;
  const auto flush = [&] {
    Points<Dim> points(Eigen::Index(batch.size()), Dim);
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

/// A connected set of flagged cells, from its first one; the flags are taken away. Empty if it
/// borders on the outside.
template <int Dim>
std::vector<std::size_t> enclosed_set(const Lattice<Dim>& lattice, std::size_t first,
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

/// The cell of a set that lies deepest in it, the first of equal ones, and its depth.
template <int Dim>
std::pair<std::size_t, int> deepest(Lattice<Dim>& lattice, const std::vector<std::size_t>& set) {
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

template <int Dim>
std::vector<Hole<Dim>> find_holes(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                                  const energy::ShapeEnergy<Dim>& energy) {
  Lattice<Dim> lattice(setting, shape);
  std::vector<char> unwanted = unwanted_cells<Dim>(lattice, energy);
  const double spacing = setting.extent().index_to_world.linear().colwise().norm().minCoeff();
  std::vector<Hole<Dim>> holes;
  for (std::size_t at = 0; at < lattice.n(); ++at) {
    if (!unwanted[at]) continue;
    const std::vector<std::size_t> set = enclosed_set<Dim>(lattice, at, unwanted);
    if (set.empty()) continue;
    const auto [place, depth] = deepest<Dim>(lattice, set);
    if (depth < kLeastDepth) continue;
    // n layers of neighbours are a diamond or octahedron: the ball in it has n / sqrt(Dim).
    holes.push_back({lattice.position(place), (depth - 0.5) / std::sqrt(double(Dim)) * spacing});
  }
  return holes;
}

template <int Dim>
int open_holes(const Setting<Dim>& setting, Simplices<Dim>& shape,
               const std::vector<Hole<Dim>>& holes, double edge_length_mm,
               energy::ShapeEnergy<Dim>& energy) {
  int n_opened = 0;
  energy.reset({shape.points, shape.elements});
  double J = energy.value();
  for (const Hole<Dim>& hole : holes) {
    const Simplices<Dim> ball =
        setting.ball(hole.center, hole.radius_mm, std::min(edge_length_mm, hole.radius_mm / 2));
    Simplices<Dim> with = setting.joined({shape, setting.flipped(ball)});
    energy.reset({with.points, with.elements});
    if (energy.value() >= J) continue;
    J = energy.value();
    shape = std::move(with);
    ++n_opened;
  }
  energy.reset({shape.points, shape.elements});
  return n_opened;
}

template std::vector<Hole<2>> find_holes<2>(const Setting<2>&, const Segments&,
                                            const energy::ShapeEnergy<2>&);
template std::vector<Hole<3>> find_holes<3>(const Setting<3>&, const Triangles&,
                                            const energy::ShapeEnergy<3>&);
template int open_holes<2>(const Setting<2>&, Segments&, const std::vector<Hole<2>>&, double,
                           energy::ShapeEnergy<2>&);
template int open_holes<3>(const Setting<3>&, Triangles&, const std::vector<Hole<3>>&, double,
                           energy::ShapeEnergy<3>&);

}  // namespace surf::segment
