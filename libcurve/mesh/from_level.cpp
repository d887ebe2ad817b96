#include "libcurve/mesh/from_level.h"

#include <algorithm>
#include <vector>

namespace surf::curve {
namespace {

constexpr double kLeastFraction = 0.05;  // of an edge, from its ends: elements stay sound
// Corners of a cell, counter-clockwise in indices; edge e runs from corner e to the next one.
constexpr std::array<std::array<int, 2>, 4> kCorner = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

class March {
 public:
  March(std::span<const float> values, const std::array<int, 2>& size,
        const Eigen::Affine2d& index_to_world, double level)
      : values_(values),
        size_(size),
        index_to_world_(index_to_world),
        level_(level),
        row_(size[0] + 2),
        node_{std::vector<int>(row_ * (size[1] + 2), -1),
              std::vector<int>(row_ * (size[1] + 2), -1)} {}

  Segments run() {
    for (int j = -1; j < size_[1]; ++j)
      for (int i = -1; i < size_[0]; ++i) add_cell(i, j);
    Segments out;
    out.points.resize(Eigen::Index(points_.size()), 2);
    for (std::size_t n = 0; n < points_.size(); ++n) out.points.row(Eigen::Index(n)) = points_[n];
    out.elements.resize(Eigen::Index(elements_.size()), 2);
    for (std::size_t n = 0; n < elements_.size(); ++n)
      out.elements.row(Eigen::Index(n)) = Eigen::RowVector2i::Map(elements_[n].data());
    if (index_to_world_.linear().determinant() < 0) out.elements.col(0).swap(out.elements.col(1));
    return out;
  }

 private:
  bool is_on_grid(int i, int j) const { return i >= 0 && j >= 0 && i < size_[0] && j < size_[1]; }
  double value(int i, int j) const { return values_[std::size_t(j) * size_[0] + i]; }
  bool is_inside(int i, int j) const { return is_on_grid(i, j) && value(i, j) > level_; }

  /// An element for each run of inside corners, from where it is left to where it is entered.
  void add_cell(int i, int j) {
    std::array<bool, 4> inside;
    for (int c = 0; c < 4; ++c) inside[c] = is_inside(i + kCorner[c][0], j + kCorner[c][1]);
    for (int leaving = 0; leaving < 4; ++leaving) {
      if (!inside[leaving] || inside[(leaving + 1) % 4]) continue;
      int first = leaving;
      while (inside[(first + 3) % 4]) first = (first + 3) % 4;
      elements_.push_back({node_on(i, j, leaving), node_on(i, j, (first + 3) % 4)});
    }
  }

  int node_on(int i, int j, int edge) {
    const auto &a = kCorner[edge], &b = kCorner[(edge + 1) % 4];
    const int i0 = i + std::min(a[0], b[0]), j0 = j + std::min(a[1], b[1]);
    const int axis = a[0] == b[0];  // along i or j
    int& node = node_[axis][std::size_t(j0 + 1) * row_ + std::size_t(i0 + 1)];
    if (node < 0) {
      node = int(points_.size());
      Eigen::Vector2d index(i0, j0);
      index[axis] += fraction(i0, j0, i0 + (axis == 0), j0 + (axis == 1));
      points_.push_back(index_to_world_ * index);
    }
    return node;
  }

  double fraction(int i0, int j0, int i1, int j1) const {
    if (!is_on_grid(i0, j0) || !is_on_grid(i1, j1)) return 0.5;
    const double from = value(i0, j0), to = value(i1, j1);
    return std::clamp((level_ - from) / (to - from), kLeastFraction, 1 - kLeastFraction);
  }

  std::span<const float> values_;
  std::array<int, 2> size_;
  Eigen::Affine2d index_to_world_;
  double level_;
  std::size_t row_;
  std::array<std::vector<int>, 2>
      node_;  ///< on the edges along i and j, -1 where there is none yet
  std::vector<Eigen::Vector2d> points_;
  std::vector<std::array<int, 2>> elements_;
};

}  // namespace

Segments curve_of_level(std::span<const float> values, const std::array<int, 2>& size,
                        const Eigen::Affine2d& index_to_world, double level) {
  return March(values, size, index_to_world, level).run();
}

}  // namespace surf::curve
