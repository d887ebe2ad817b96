#include "libsurf/mesh/from_label_map.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/marching_cubes.h"

namespace surf::mesh {
namespace {

/// Walks through the volume by pairs of slices, with a border of one voxel outside all round.
class March {
 public:
  March(const volume::Volume& labels, std::optional<int> label)
      : labels_(labels),
        label_(label),
        nx_(labels.size()[0] + 2),
        ny_(labels.size()[1] + 2),
        values_(std::size_t(labels.size()[0]) * labels.size()[1]) {
    for (auto& slice : inside_) slice.assign(std::size_t(nx_) * ny_, 0);
    for (auto& vertices : vertex_) vertices.assign(std::size_t(nx_) * ny_, -1);
  }

  Triangles run() {
    for (int k = 0; k <= labels_.size()[2]; ++k) {  // slices k-1 and k
      std::swap(inside_[0], inside_[1]);
      std::swap(is_empty_[0], is_empty_[1]);
      load_slice(k);
      if (is_empty_[0] && is_empty_[1]) continue;
      // Edges within the lower slice keep the vertices they got as the upper one.
      std::swap(vertex_[0], vertex_[3]);
      std::swap(vertex_[1], vertex_[4]);
      for (const int fresh : {2, 3, 4}) std::fill(vertex_[fresh].begin(), vertex_[fresh].end(), -1);
      for (int j = 0; j + 1 < ny_; ++j)
        for (int i = 0; i + 1 < nx_; ++i) add_cube(i, j, k);
    }
    return result();
  }

 private:
  void load_slice(int k) {
    const auto& size = labels_.size();
    is_empty_[1] = true;
    std::fill(inside_[1].begin(), inside_[1].end(), 0);
    if (k == size[2]) return;
    labels_.copy_box({0, 0, k}, {size[0], size[1], k + 1}, values_.data());
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (is_labelled(values_[std::size_t(j) * size[0] + i], label_)) {
          inside_[1][std::size_t(j + 1) * nx_ + i + 1] = 1;
          is_empty_[1] = false;
        }
  }

  void add_cube(int i, int j, int k) {
    const std::size_t at = std::size_t(j) * nx_ + i;
    const auto pair = [&](int slice, std::size_t row) {
      return inside_[slice][row] | inside_[slice][row + 1] << 1;
    };
    const int mask =
        pair(0, at) | pair(0, at + nx_) << 2 | pair(1, at) << 4 | pair(1, at + nx_) << 6;
    if (mask == 0 || mask == 255) return;
    for (const std::array<int, 3>& triangle : cube_triangles(mask))
      elements_.push_back({vertex_on(triangle[0], i, j, k), vertex_on(triangle[1], i, j, k),
                           vertex_on(triangle[2], i, j, k)});
  }

  /// The vertex on an edge of the cube, whose corner 0 is at (i - 1, j - 1, k - 1).
  int vertex_on(int edge, int i, int j, int k) {
    const auto [axis, corner] = cube_edge(edge);
    const std::size_t at = std::size_t(j + (corner >> 1 & 1)) * nx_ + i + (corner & 1);
    int& vertex = vertex_[axis == 2 ? 2 : axis + 3 * (corner >> 2)][at];
    if (vertex < 0) {
      vertex = static_cast<int>(points_.size());
      const Vector<3> index = Vector<3>(i - 1, j - 1, k - 1) + cube_edge(edge).middle();
      points_.push_back(labels_.index_to_world() * index);
    }
    return vertex;
  }

  Triangles result() const {
    if (elements_.empty())
      throw InputError(
          label_ ? fmt::format("{}: no voxel has the label {}", labels_.source().path, *label_)
                 : fmt::format("{}: all voxels are 0", labels_.source().path));
    Triangles surface;
    surface.points.resize(static_cast<Eigen::Index>(points_.size()), 3);
    surface.elements.resize(static_cast<Eigen::Index>(elements_.size()), 3);
    for (std::size_t i = 0; i < points_.size(); ++i)
      surface.points.row(static_cast<Eigen::Index>(i)) = points_[i].transpose();
    for (std::size_t i = 0; i < elements_.size(); ++i)
      surface.elements.row(static_cast<Eigen::Index>(i)) =
          Eigen::RowVector3i::Map(elements_[i].data());
    if (labels_.index_to_world().linear().determinant() < 0)
      surface.elements.col(1).swap(surface.elements.col(2));
    return surface;
  }

  const volume::Volume& labels_;
  std::optional<int> label_;
  int nx_, ny_;
  std::vector<float> values_;
  std::array<std::vector<std::uint8_t>, 2> inside_;  // lower and upper slice
  std::array<bool, 2> is_empty_{true, true};
  /// Vertices on the edges along x and y of the lower slice (0, 1), along z (2), and along x
  /// and y of the upper slice (3, 4), by the edge's first voxel; -1 where there is none yet.
  std::array<std::vector<int>, 5> vertex_;
  std::vector<Vector<3>> points_;
  std::vector<std::array<int, 3>> elements_;
};

}  // namespace

Triangles surface_of_label_map(const volume::Volume& labels, std::optional<int> label) {
  return March(labels, label).run();
}

}  // namespace surf::mesh
