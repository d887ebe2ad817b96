#include "libsurf/mesh/detail/close_pairs.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surf::mesh {
namespace {

struct Extent {
  Eigen::Vector3d lower, upper;
};

Extent extent(const std::vector<BoundingBall>& balls) {
  Extent out{balls.front().center, balls.front().center};
  for (const BoundingBall& ball : balls) {
    out.lower = out.lower.cwiseMin(ball.center);
    out.upper = out.upper.cwiseMax(ball.center);
  }
  return out;
}

}  // namespace

std::vector<BoundingBall> bounding_balls(const Points<3>& X, const Elements<3>& T) {
  std::vector<BoundingBall> balls(T.rows());
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Eigen::Vector3d a = X.row(T(t, 0)), b = X.row(T(t, 1)), c = X.row(T(t, 2));
    const Eigen::Vector3d center = (a + b + c) / 3;
    const double squared = std::max(
        {(a - center).squaredNorm(), (b - center).squaredNorm(), (c - center).squaredNorm()});
    balls[t] = {center, std::sqrt(squared)};
  }
  return balls;
}

RowGrid::RowGrid(const std::vector<BoundingBall>& balls, double reach)
    : reach_(reach * (1 + 1e-9)) {
  assert(reach >= 0);
  if (balls.empty()) {
    first_ = {0};
    return;
  }
  const auto [lower, upper] = extent(balls);
  const double width = upper[1] - lower[1], height = upper[2] - lower[2];
  const double most_rows = 4.0 * double(balls.size()) + 1000;
  double side = reach_ > 0
                    ? reach_
                    : 1;  // of the rows; wider where points are so far apart that most are empty
  while ((width / side + 1) * (height / side + 1) > most_rows) side *= 2;
  n_y_ = static_cast<int>(width / side) + 1;
  n_z_ = static_cast<int>(height / side) + 1;
  std::vector<int> row_of(balls.size());
  first_.assign(std::size_t(n_y_) * n_z_ + 1, 0);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Eigen::Vector3d at = (balls[i].center - lower) / side;
    row_of[i] = std::min(static_cast<int>(at[1]), n_y_ - 1) +
                n_y_ * std::min(static_cast<int>(at[2]), n_z_ - 1);
    ++first_[row_of[i] + 1];
  }
  for (std::size_t row = 0; row + 1 < first_.size(); ++row) first_[row + 1] += first_[row];
  entries_.resize(balls.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const auto& [center, radius] = balls[i];
    entries_[next[row_of[i]]++] = {center[0], center[1], center[2], radius, static_cast<int>(i)};
  }
  for (int row = 0; row < n_rows(); ++row)
    std::sort(entries_.begin() + first_[row], entries_.begin() + first_[row + 1],
              [](const Entry& a, const Entry& b) {
                return a.x != b.x ? a.x < b.x : a.number < b.number;
              });
}

}  // namespace surf::mesh
