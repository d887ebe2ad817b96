#include "libsurf/segment/denoised.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/volume/screened_poisson.h"

namespace surf::segment {
namespace {

using Index3 = std::array<int, 3>;

/// Solves one block with its margin and takes over the block's own voxels.
class Blocks {
 public:
  Blocks(const volume::Volume& volume, const Triangles& surface, double mu,
         const DenoisedOptions& options)
      : volume_(volume),
        surface_(surface),
        mu_(mu),
        options_(options),
        is_inside_(mesh::rasterize(surface, volume.size(), volume.index_to_world())),
        values_(volume.n_voxels()) {
    for (int axis = 0; axis < 3; ++axis)
      margin_[axis] = static_cast<int>(std::ceil(std::min(
          options.margin * std::sqrt(mu) * volume.world_to_index().linear().row(axis).norm(),
          double(volume.size()[axis]))));
  }

  std::vector<float> run() {
    const Index3& size = volume_.size();
    for (int k = 0; k < size[2]; k += options_.block)
      for (int j = 0; j < size[1]; j += options_.block)
        for (int i = 0; i < size[0]; i += options_.block) solve({i, j, k});
    return std::move(values_);
  }

 private:
  void solve(const Index3& first) {
    Index3 end, lower, upper;  // of the block; of the box
    for (int axis = 0; axis < 3; ++axis) {
      end[axis] = std::min(first[axis] + options_.block, volume_.size()[axis]);
      lower[axis] = std::max(first[axis] - margin_[axis], 0);
      upper[axis] = std::min(end[axis] + margin_[axis], volume_.size()[axis]);
      lower[axis] = std::min(lower[axis], upper[axis] - 2);  // a block of one layer
    }
    volume::Grid grid{{upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]},
                      volume_.index_to_world()};
    grid.index_to_world.translate(Eigen::Vector3d(lower[0], lower[1], lower[2]));
    std::vector<float> voxels(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2]);
    volume_.copy_box(lower, upper, voxels.data());
    const std::vector<double> I(voxels.begin(), voxels.end());
    const auto cells = volume::cut_cells(surface_.points, surface_.elements, grid);
    const volume::ScreenedPoissonOptions solver{.tolerance = options_.tolerance};
    for (const int side : {0, 1}) {
      const volume::ScreenedPoisson u(cells[side], grid, mu_, I, solver);
      take(u, side == 0, first, end, lower);
    }
  }

  void take(const volume::ScreenedPoisson& u, bool is_inside, const Index3& first,
            const Index3& end, const Index3& lower) {
    for (int k = first[2]; k < end[2]; ++k)
      for (int j = first[1]; j < end[1]; ++j)
        for (int i = first[0]; i < end[0]; ++i) {
          const std::size_t at = (std::size_t(k) * volume_.size()[1] + j) * volume_.size()[0] + i;
          if ((is_inside_[at] != 0) == is_inside)
            values_[at] =
                static_cast<float>(u.node_value(i - lower[0], j - lower[1], k - lower[2]));
        }
  }

  const volume::Volume& volume_;
  const Triangles& surface_;
  double mu_;
  DenoisedOptions options_;
  std::vector<std::uint8_t> is_inside_;
  std::vector<float> values_;
  Index3 margin_;
};

}  // namespace

std::string DenoisedOptions::error() const {
  if (!(tolerance > 0))
    return fmt::format("DenoisedOptions::tolerance = {} violates > 0", tolerance);
  if (block < 1) return fmt::format("DenoisedOptions::block = {} violates >= 1", block);
  if (!(margin >= 0)) return fmt::format("DenoisedOptions::margin = {} violates >= 0", margin);
  return {};
}

volume::Volume denoised(const volume::Volume& volume, const Triangles& surface, double mu,
                        const DenoisedOptions& options) {
  if (!(mu > 0)) throw UsageError(fmt::format("denoised: mu = {} violates > 0", mu));
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return {volume.size(), volume.index_to_world(), Blocks(volume, surface, mu, options).run()};
}

}  // namespace surf::segment
