#include "libsurf/mesh/from_label_map.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"
#include "libsurf/mesh/marching_cubes.h"

namespace surf::mesh {
namespace {

constexpr double kLeastFraction = 0.05;  // of an edge, from its ends: triangles stay sound

/// Walks through the volume by pairs of slices, with a border of one voxel outside all round.
class March {
 public:
  /// @param is_inside  of a voxel's value
  /// @param fraction   where the surface cuts an edge from one value to another, in [0, 1]; at the
  ///                   volume's border in the middle
  March(const volume::Volume& volume, std::function<bool(float)> is_inside,
        std::function<double(float, float)> fraction)
      : volume_(volume),
        is_inside_(std::move(is_inside)),
        fraction_(std::move(fraction)),
        nx_(volume.size()[0] + 2),
        ny_(volume.size()[1] + 2) {
    for (auto& slice : inside_) slice.assign(std::size_t(nx_) * ny_, 0);
    for (auto& values : values_) values.resize(std::size_t(volume.size()[0]) * volume.size()[1]);
    for (auto& vertices : vertex_) vertices.assign(std::size_t(nx_) * ny_, -1);
  }

  /// Empty if no voxel is inside.
  Triangles run() {
    for (int k = 0; k <= volume_.size()[2]; ++k) {  // slices k-1 and k
      std::swap(inside_[0], inside_[1]);
      std::swap(values_[0], values_[1]);
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
    const auto& size = volume_.size();
    is_empty_[1] = true;
    std::fill(inside_[1].begin(), inside_[1].end(), 0);
    if (k == size[2]) return;
    volume_.copy_box({0, 0, k}, {size[0], size[1], k + 1}, values_[1].data());
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        if (is_inside_(values_[1][std::size_t(j) * size[0] + i])) {
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
      const Vector<3> index = Vector<3>(i - 1, j - 1, k - 1) + cut(edge, i, j, k);
      points_.push_back(volume_.index_to_world() * index);
    }
    return vertex;
  }

  /// Of the edge of the cube whose corner 0 is at (i - 1, j - 1, k - 1).
  Vector<3> cut(int edge, int i, int j, int k) const {
    const auto [axis, corner] = cube_edge(edge);
    Vector<3> point = cube_edge(edge).middle();
    const auto& size = volume_.size();
    const auto value = [&](int c) -> std::optional<float> {
      const int x = i - 1 + (c & 1), y = j - 1 + (c >> 1 & 1), z = k - 1 + (c >> 2);
      if (x < 0 || y < 0 || z < 0 || x >= size[0] || y >= size[1] || z >= size[2]) return {};
      return values_[c >> 2][std::size_t(y) * size[0] + x];
    };
    const auto from = value(corner), to = value(corner | 1 << axis);
    if (from && to) point[axis] = fraction_(*from, *to);
    return point;
  }

  Triangles result() const {
    Triangles surface{points_of<3>(points_), elements_of(elements_)};
    if (!elements_.empty() && volume_.index_to_world().linear().determinant() < 0)
      surface.elements.col(1).swap(surface.elements.col(2));
    return surface;
  }

  const volume::Volume& volume_;
  std::function<bool(float)> is_inside_;
  std::function<double(float, float)> fraction_;
  int nx_, ny_;
  std::array<std::vector<float>, 2> values_;  // lower and upper slice
  std::array<std::vector<std::uint8_t>, 2> inside_;
  std::array<bool, 2> is_empty_{true, true};
  /// Vertices on the edges along x and y of the lower slice (0, 1), along z (2), and along x
  /// and y of the upper slice (3, 4), by the edge's first voxel; -1 where there is none yet.
  std::array<std::vector<int>, 5> vertex_;
  std::vector<Vector<3>> points_;
  std::vector<std::array<int, 3>> elements_;
};

}  // namespace

void check_label(std::optional<int> label) {
  constexpr int kBeyond = 1 << 24;
  if (label && (*label >= kBeyond || *label <= -kBeyond))
    throw InputError(
        fmt::format("label {}: labels from 2^24 = {} on are not told apart, voxels are 32-bit "
                    "floats; renumber the labels",
                    *label, kBeyond));
}

Triangles surface_of_label_map(const volume::Volume& labels, std::optional<int> label) {
  check_label(label);
  Triangles surface = March(
                          labels, [&](float value) { return is_labelled(value, label); },
                          [](float, float) { return 0.5; })
                          .run();
  if (surface.elements.rows() == 0)
    throw InputError(
        label ? fmt::format("{}: no voxel has the label {}", labels.source().path, *label)
              : fmt::format("{}: all voxels are 0", labels.source().path));
  return surface;
}

Triangles surface_of_level(const volume::Volume& values, double level) {
  return March(
             values, [&](float value) { return value > level; },
             [&](float from, float to) {
               return std::clamp((level - from) / (double(to) - from), kLeastFraction,
                                 1 - kLeastFraction);
             })
      .run();
}

}  // namespace surf::mesh
