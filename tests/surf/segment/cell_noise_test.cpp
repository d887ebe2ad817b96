#include "libsurf/segment/detail/cell_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace surf::segment {
namespace {

constexpr std::array<int, 3> kSize = {30, 30, 30};

/// All cells of an image, each with the mean of the noise of `n` cells along the first axis.
std::pair<EdgeCells<3>, std::vector<double>> noise_over(int n) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const std::size_t n_cells = std::size_t(kSize[0]) * kSize[1] * kSize[2];
  std::vector<double> white(n_cells + std::size_t(n)), residuals(n_cells, 0.0);
  for (double& value : white) value = normal(random);
  std::vector<EdgeCell<3>> cells(n_cells);
  for (std::size_t k = 0; k < n_cells; ++k) {
    cells[k].index = k;
    for (int j = 0; j < n; ++j) residuals[k] += white[k + std::size_t(j)] / std::sqrt(n);
  }
  std::vector<std::uint32_t> by_index(n_cells);
  std::iota(by_index.begin(), by_index.end(), 0u);
  for (EdgeCell<3>& cell : cells) cell.element = 0;
  return {EdgeCells<3>(std::move(cells), std::move(by_index), Elements<3>::Zero(1, 3), 1),
          std::move(residuals)};
}

TEST(CellNoise, CountsCellsThatTellAsMuchAsOne) {
  const auto [cells, white] = noise_over(1);
  EXPECT_NEAR(noise_correlation<3>(cells, white, kSize), 1, 0.25);
  // Means of two: neighbours have a correlation of one half; of three: 2/3 and 1/3.
  const auto [same, of_two] = noise_over(2);
  EXPECT_NEAR(noise_correlation<3>(same, of_two, kSize), 2, 0.25);
  EXPECT_NEAR(noise_correlation<3>(same, noise_over(3).second, kSize), 3, 0.35);
}

TEST(CellNoise, HalvesAreOfWholeBlocksWhereNoiseIsAlike) {
  int n_first = 0, n_alone = 0;
  const auto index = [](int i, int j, int k) {
    return std::uint64_t(i) + 30 * (std::uint64_t(j) + 30 * std::uint64_t(k));
  };
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 30; ++j)
      for (int i = 0; i < 30; ++i) {
        const bool is_first = is_in_first_half<3>(index(i, j, k), kSize, 10);
        n_alone += is_first != is_in_first_half<3>(index(i, j, k), kSize, 1);
        n_first += is_first;
        EXPECT_EQ(is_first, is_in_first_half<3>(index(i - i % 3, j - j % 3, k - k % 3), kSize, 10));
      }
  EXPECT_NEAR(n_first, 13500, 1000);
  EXPECT_NEAR(n_alone, 13500, 1000);  // of single cells where noise is not alike
}

}  // namespace
}  // namespace surf::segment
