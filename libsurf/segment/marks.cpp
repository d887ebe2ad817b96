#include "libsurf/segment/marks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "libsurf/base/error.h"
#include "libsurf/segment/detail/point_text.h"

namespace surf::segment {
namespace {

constexpr double kMostOff = 1e-3;  // cells: affines are stored as floats, or as quaternions

template <int Dim>
using Cell = std::array<int, Dim>;

template <int Dim>
Cell<Dim> cell_at(const ImageBox<Dim>& image, std::size_t at) {
  Cell<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) {
    out[axis] = int(at % std::size_t(image.size[axis]));
    at /= std::size_t(image.size[axis]);
  }
  return out;
}

template <int Dim>
Vector<Dim> index_of(const Cell<Dim>& cell) {
  Vector<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) out[axis] = cell[axis];
  return out;
}

/// Calls visit(at) for the cells round one, those at its corners included.
template <int Dim, class Visit>
void for_neighbours(const ImageBox<Dim>& image, const Cell<Dim>& cell, const Visit& visit) {
  const int n = Dim == 3 ? 27 : 9;
  for (int k = 0; k < n; ++k) {
    std::size_t at = 0;
    bool is_in = true;
    for (int axis = Dim - 1; axis >= 0; --axis) {
      const int step = (axis == 0 ? k % 3 : axis == 1 ? k / 3 % 3 : k / 9) - 1;
      const int here = cell[axis] + step;
      is_in = is_in && here >= 0 && here < image.size[axis];
      at = at * std::size_t(image.size[axis]) + std::size_t(std::max(here, 0));
    }
    if (is_in) visit(at);
  }
}

/// All cells of one label that hang together, in ascending order.
template <int Dim>
std::vector<std::size_t> part_from(const ImageBox<Dim>& image, std::span<const float> labels,
                                   std::size_t first, std::vector<char>& is_done) {
  std::vector<std::size_t> out = {first};
  is_done[first] = 1;
  for (std::size_t next = 0; next < out.size(); ++next)
    for_neighbours<Dim>(image, cell_at<Dim>(image, out[next]), [&](std::size_t at) {
      if (is_done[at] || labels[at] != labels[first]) return;
      is_done[at] = 1;
      out.push_back(at);
    });
  std::sort(out.begin(), out.end());
  return out;
}

/// The middle one of a block's cells, of equals the first.
template <int Dim>
Cell<Dim> middle_of(const std::vector<Cell<Dim>>& cells) {
  Vector<Dim> centre = Vector<Dim>::Zero();
  for (const Cell<Dim>& cell : cells) centre += index_of<Dim>(cell) / double(cells.size());
  return *std::min_element(cells.begin(), cells.end(), [&](const auto& a, const auto& b) {
    return (index_of<Dim>(a) - centre).squaredNorm() < (index_of<Dim>(b) - centre).squaredNorm();
  });
}

/// The middle cell of each block of cells, for the least blocks that leave few enough.
template <int Dim>
std::vector<Cell<Dim>> thinned(const std::vector<Cell<Dim>>& cells) {
  for (int side = 1;; ++side) {
    std::map<Cell<Dim>, std::vector<Cell<Dim>>> blocks;
    for (const Cell<Dim>& cell : cells) {
      Cell<Dim> block;
      for (int axis = 0; axis < Dim; ++axis) block[axis] = cell[axis] / side;
      blocks[block].push_back(cell);
    }
    if (blocks.size() > kMostPointsOfStroke) continue;
    std::vector<Cell<Dim>> out;
    for (const auto& [block, of_block] : blocks) out.push_back(middle_of<Dim>(of_block));
    return out;
  }
}

template <int Dim>
Click<Dim> stroke_of(const ImageBox<Dim>& image, const std::vector<std::size_t>& part, Side side) {
  std::vector<Cell<Dim>> cells;
  for (const std::size_t at : part) cells.push_back(cell_at<Dim>(image, at));
  const Cell<Dim> nearest = middle_of<Dim>(cells);
  Click<Dim> out{image.index_to_world * index_of<Dim>(nearest), side};
  for (const Cell<Dim>& cell : thinned<Dim>(cells))
    if (cell != nearest) out.stroke_mm.push_back(image.index_to_world * index_of<Dim>(cell));
  return out;
}

template <int Dim>
std::string geometry_text(const ImageBox<Dim>& image) {
  Vector<Dim> spacing = image.index_to_world.linear().colwise().norm().transpose();
  return fmt::format("{} {}s of {:.6g} mm, the first at ({}) mm", fmt::join(image.size, " x "),
                     Dim == 3 ? "voxel" : "pixel", fmt::join(spacing, " x "),
                     point_text<Dim>(image.index_to_world.translation()));
}

}  // namespace

template <int Dim>
std::vector<Click<Dim>> strokes(const ImageBox<Dim>& image, std::span<const float> labels) {
  struct Part {
    std::vector<std::size_t> cells;
    Side side;
  };
  std::vector<Part> parts;
  std::vector<char> is_done(labels.size());
  for (std::size_t at = 0; at < labels.size(); ++at) {
    if (labels[at] == 0 || is_done[at]) continue;
    if (labels[at] != 1 && labels[at] != 2)
      throw InputError(fmt::format("label {:g} at {} ({}): expected 0, 1 inside or 2 outside",
                                   labels[at], Dim == 3 ? "voxel" : "pixel",
                                   fmt::join(cell_at<Dim>(image, at), ", ")));
    parts.push_back({part_from<Dim>(image, labels, at, is_done),
                     labels[at] == 1 ? Side::kInside : Side::kOutside});
  }
  if (parts.empty())
    throw InputError(fmt::format("no {} is marked: expected label 1 inside, 2 outside",
                                 Dim == 3 ? "voxel" : "pixel"));
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    if (a.side != b.side) return a.side == Side::kInside;
    return a.cells.size() > b.cells.size();
  });
  std::vector<Click<Dim>> out;
  for (const Part& part : parts) out.push_back(stroke_of<Dim>(image, part.cells, part.side));
  return out;
}

template <int Dim>
void check_same_grid(const ImageBox<Dim>& image, const ImageBox<Dim>& marks) {
  const char* noun = Dim == 3 ? "volume" : "image";
  if (marks.size != image.size)
    throw InputError(fmt::format("is on another grid than the {}: {}; the {} has {}", noun,
                                 geometry_text<Dim>(marks), noun, geometry_text<Dim>(image)));
  double off = 0;
  for (int corner = 0; corner < (1 << Dim); ++corner) {
    Vector<Dim> index;
    for (int axis = 0; axis < Dim; ++axis)
      index[axis] = (corner >> axis & 1) != 0 ? image.size[axis] - 1 : 0;
    off = std::max(
        off, (image.world_to_index * (marks.index_to_world * index) - index).cwiseAbs().maxCoeff());
  }
  if (!(off <= kMostOff))
    throw InputError(fmt::format(
        "is on another grid than the {}, up to {:.3g} {}s away: {}; the {} has {}", noun, off,
        Dim == 3 ? "voxel" : "pixel", geometry_text<Dim>(marks), noun, geometry_text<Dim>(image)));
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template std::vector<Click<Dim>> strokes<Dim>(const ImageBox<Dim>&, std::span<const float>); \
  template void check_same_grid<Dim>(const ImageBox<Dim>&, const ImageBox<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
