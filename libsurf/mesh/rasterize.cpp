#include "libsurf/mesh/rasterize.h"

#include "libsurf/mesh/detail/grid_crossings.h"

namespace surf::mesh {
namespace {

/// Changes of the winding number along +i, for grid points (i, j, k) at
/// (k * size_j + j) * (size_i + 1) + i.
class WindingChanges {
 public:
  explicit WindingChanges(const std::array<int, 3>& size)
      : size_(size), changes_(std::size_t(size[0] + 1) * size[1] * size[2]) {}

  void add(double i, int j, int k, int sign) {
    changes_[(std::size_t(k) * size_[1] + j) * (size_[0] + 1) + first_index(i, size_[0])] +=
        static_cast<std::int16_t>(sign);
  }

  std::vector<std::uint8_t> inside() const {
    std::vector<std::uint8_t> result;
    result.reserve(std::size_t(size_[0]) * size_[1] * size_[2]);
    for (std::size_t row = 0; row < std::size_t(size_[1]) * size_[2]; ++row) {
      int winding = 0;
      for (int i = 0; i < size_[0]; ++i) {
        winding += changes_[row * (size_[0] + 1) + i];
        result.push_back(winding != 0);
      }
    }
    return result;
  }

 private:
  std::array<int, 3> size_;
  std::vector<std::int16_t> changes_;
};

}  // namespace

std::vector<std::uint8_t> rasterize(const Triangles& surface, const std::array<int, 3>& size,
                                    const Eigen::Affine3d& index_to_world) {
  const Eigen::Affine3d world_to_index = index_to_world.inverse();
  const Points<3> points = (surface.points * world_to_index.linear().transpose()).rowwise() +
                           world_to_index.translation().transpose();
  const GridCrossings crossings(points, size);
  WindingChanges changes(size);
  for (const auto element : surface.elements.rowwise())
    crossings.visit_triangle(element,
                             [&](double i, int j, int k, int sign) { changes.add(i, j, k, sign); });
  return changes.inside();
}

}  // namespace surf::mesh
