#include "libsurf/segment/detail/edge_cells.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace surf::segment {
namespace {

constexpr Eigen::Index kElements = 512;  // of a task
constexpr int kNewtonSteps = 6;
constexpr double kNewtonTolerance = 1e-7;  // of the reach
constexpr double kOnSide = 1e-9;           // of a barycentric coordinate: both elements have it

/// The space that an element sweeps along the normals of its vertices.
template <int Dim>
class Prism {
 public:
  Prism(const fem::Geometry<Dim>& geometry, const Points<Dim>& normals, Eigen::Index t,
        double reach_mm)
      : reach_mm_(reach_mm), nu_(geometry.normals().row(t)) {
    for (int i = 0; i < Dim; ++i) {
      const int vertex = geometry.elements()(t, i);
      p_[i] = geometry.points().row(vertex);
      n_[i] = normals.row(vertex);
      lean_[i] = n_[i].dot(nu_);
    }
    steepest_ = *std::max_element(lean_.begin(), lean_.end());
    for (int i = 0; i < Dim; ++i) {
      away_[i] = geometry.basis_gradients(t).row(i);
      furthest_[i] = -1e300;
      for (int j = 0; j < Dim; ++j)
        for (const double t_mm : {-reach_mm_, reach_mm_})
          furthest_[i] = std::max(furthest_[i], -away_[i].dot(p_[j] + t_mm * n_[j]));
      furthest_[i] += kNewtonTolerance * (1 + std::abs(furthest_[i]));
    }
  }

  /// Whether x is beyond all of its corners on one side, as much of its box is.
  bool is_beyond(const Vector<Dim>& x) const {
    for (int i = 0; i < Dim; ++i)
      if (-away_[i].dot(x) > furthest_[i]) return true;
    return false;
  }

  /// Indices of cells that may lie in it.
  void box(const ImageBox<Dim>& cells, std::array<int, Dim>& lower,
           std::array<int, Dim>& upper) const {
    Vector<Dim> low = Vector<Dim>::Constant(1e300), high = -low;
    for (int i = 0; i < Dim; ++i)
      for (const double t_mm : {-reach_mm_, reach_mm_}) {
        const Vector<Dim> at = cells.world_to_index * Vector<Dim>(p_[i] + t_mm * n_[i]);
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
      }
    for (int axis = 0; axis < Dim; ++axis) {
      lower[axis] = int(std::ceil(std::max(low[axis], 0.0)));
      upper[axis] = int(std::floor(std::min(high[axis], cells.size[axis] - 1.0))) + 1;
    }
  }

  /// Whether x lies in it, and where.
  bool locate(const Vector<Dim>& x, EdgeCell<Dim>& out) const {
    const double height = nu_.dot(x - p_[0]);
    if (std::abs(height) > reach_mm_ * steepest_) return false;
    double t = height / std::max(steepest_, 0.1);
    Vector<Dim> unknown = Vector<Dim>::Constant(1.0 / Dim);  // lambda_2, ..., lambda_Dim, t
    unknown[Dim - 1] = t;
    for (int step = 0; step < kNewtonSteps; ++step) {
      t = unknown[Dim - 1];
      const double first = 1 - unknown.template head<Dim - 1>().sum();
      Vector<Dim> normal = first * n_[0], residual = first * (p_[0] + t * n_[0]) - x;
      Eigen::Matrix<double, Dim, Dim> J;
      for (int i = 1; i < Dim; ++i) {
        normal += unknown[i - 1] * n_[i];
        residual += unknown[i - 1] * (p_[i] + t * n_[i]);
        J.col(i - 1) = p_[i] - p_[0] + t * (n_[i] - n_[0]);
      }
      if (residual.norm() <= kNewtonTolerance * reach_mm_) return accept(unknown, out);
      J.col(Dim - 1) = normal;
      const Eigen::Matrix<double, Dim, Dim> inverse = J.inverse();
      if (!inverse.allFinite()) return false;
      unknown -= inverse * residual;
      // The map is nearly affine: what is far outside after the first step stays outside.
      if (step == 0 && unknown.template head<Dim - 1>().minCoeff() < -3) return false;
    }
    return false;
  }

 private:
  bool accept(const Vector<Dim>& unknown, EdgeCell<Dim>& out) const {
    double lean = 0;
    for (int i = 0; i < Dim; ++i) {
      const double lambda = i == 0 ? 1 - unknown.template head<Dim - 1>().sum() : unknown[i - 1];
      if (lambda < -kOnSide) return false;
      out.lambda[i] = float(lambda);
      out.reach[i] = float(lambda * lean_[i]);
      lean += lambda * lean_[i];
    }
    out.distance_mm = float(unknown[Dim - 1] * lean);
    return std::abs(unknown[Dim - 1]) <= reach_mm_ && lean > 0;
  }

  double reach_mm_, steepest_ = 0;
  Vector<Dim> nu_;
  std::array<Vector<Dim>, Dim> p_, n_;
  std::array<double, Dim> lean_;
  std::array<Vector<Dim>, Dim> away_;      // in its plane, towards each vertex [1/mm]
  std::array<double, Dim> furthest_ = {};  // of its corners the other way
};

/// Those of an element.
template <int Dim>
void add_cells(const ImageBox<Dim>& cells, const Prism<Dim>& prism, int element,
               std::vector<EdgeCell<Dim>>& out) {
  std::array<int, Dim> lower, upper;
  prism.box(cells, lower, upper);
  for (int axis = 0; axis < Dim; ++axis)
    if (lower[axis] >= upper[axis]) return;
  for (std::array<int, Dim> at = lower; at[Dim - 1] < upper[Dim - 1];) {
    Vector<Dim> index;
    std::uint64_t number = 0;
    for (int axis = Dim - 1; axis >= 0; --axis) {
      index[axis] = at[axis];
      number = number * std::uint64_t(cells.size[axis]) + std::uint64_t(at[axis]);
    }
    EdgeCell<Dim> cell;
    const Vector<Dim> x = cells.index_to_world * index;
    if (!prism.is_beyond(x) && prism.locate(x, cell)) {
      cell.index = number;
      cell.element = element;
      out.push_back(cell);
    }
    for (int axis = 0; axis < Dim; ++axis) {
      if (++at[axis] < upper[axis] || axis == Dim - 1) break;
      at[axis] = lower[axis];
    }
  }
}

/// Each cell once, with the sheet that it is nearest to. Their places by index.
template <int Dim>
std::vector<std::uint32_t> keep_nearest(std::vector<EdgeCell<Dim>>& cells) {
  struct Place {
    std::uint64_t index;
    std::uint32_t at;
  };
  std::vector<Place> places(cells.size());
  tbb::parallel_for(std::size_t(0), cells.size(), [&](std::size_t k) {
    places[k] = {cells[k].index, std::uint32_t(k)};
  });
  tbb::parallel_sort(places.begin(), places.end(), [&](const Place& a, const Place& b) {
    if (a.index != b.index) return a.index < b.index;
    return std::pair(std::abs(cells[a.at].distance_mm), a.at) <
           std::pair(std::abs(cells[b.at].distance_mm), b.at);
  });
  const auto is_same = [](const Place& a, const Place& b) { return a.index == b.index; };
  places.erase(std::unique(places.begin(), places.end(), is_same), places.end());
  std::vector<std::uint32_t> now(cells.size(), 0);  // of each cell, once the others have gone
  for (const Place& place : places) now[place.at] = 1;
  std::uint32_t n = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (now[k] == 0) continue;
    cells[n] = cells[k];
    now[k] = n++;
  }
  cells.resize(n);
  std::vector<std::uint32_t> out;
  out.reserve(n);
  for (const Place& place : places) out.push_back(now[place.at]);
  return out;
}

/// Of those of one layer of blocks along the last axis: what is read is the box that has them.
template <int Dim>
void read_layer(const Setting<Dim>& setting, const CellBlocks<Dim>& blocks,
                std::span<const std::uint32_t> of_layer, std::vector<EdgeCell<Dim>>& cells) {
  const int side = blocks.side;
  std::vector<std::array<int, Dim>> places(of_layer.size());
  std::array<int, Dim> lower, upper = {};
  lower.fill(std::numeric_limits<int>::max());
  for (std::size_t k = 0; k < of_layer.size(); ++k) {
    std::uint64_t index = cells[of_layer[k]].index;
    for (int axis = 0; axis < Dim; ++axis) {
      const auto n = std::uint64_t(blocks.box.size[axis]);
      const int at = blocks.first[axis] + int(axis == Dim - 1 ? index : index % n) * side;
      index /= n;
      places[k][axis] = at;
      lower[axis] = std::min(lower[axis], at);
      upper[axis] = std::max(upper[axis], at + side);
    }
  }
  const std::vector<float> values = setting.values(lower, upper);
  std::vector<std::size_t> of_block = {0};  // places of its cells from that of the first
  std::size_t step = 1;
  for (int axis = 0; axis < Dim; ++axis) {
    const std::size_t n = of_block.size();
    for (int along = 1; along < side; ++along)
      for (std::size_t k = 0; k < n; ++k)
        of_block.push_back(of_block[k] + std::size_t(along) * step);
    step *= std::size_t(upper[axis] - lower[axis]);
  }
  for (std::size_t k = 0; k < of_layer.size(); ++k) {
    std::size_t first = 0;
    for (int axis = Dim - 1; axis >= 0; --axis)
      first = first * std::size_t(upper[axis] - lower[axis]) +
              std::size_t(places[k][axis] - lower[axis]);
    double sum = 0, squares = 0;
    for (const std::size_t at : of_block) {
      const double less = double(values[first + at]) - values[first];
      sum += less;
      squares += less * less;
    }
    const auto n = double(of_block.size());
    EdgeCell<Dim>& cell = cells[of_layer[k]];
    cell.value = float(values[first] + sum / n);
    cell.variance = float(std::max(0.0, squares / n - sum / n * (sum / n)));
  }
}

/// Fills in the values, layer by layer.
template <int Dim>
void read_values(const Setting<Dim>& setting, const CellBlocks<Dim>& blocks,
                 const std::vector<std::uint32_t>& by_index, std::vector<EdgeCell<Dim>>& cells) {
  std::uint64_t layer = 1;
  for (int axis = 0; axis < Dim - 1; ++axis) layer *= std::uint64_t(blocks.box.size[axis]);
  const auto layer_of = [&](std::size_t k) { return cells[by_index[k]].index / layer; };
  std::vector<std::span<const std::uint32_t>> layers;
  for (std::size_t begin = 0, end = 0; begin < by_index.size(); begin = end) {
    while (end < by_index.size() && layer_of(end) == layer_of(begin)) ++end;
    layers.emplace_back(by_index.data() + begin, end - begin);
  }
  tbb::parallel_for(std::size_t(0), layers.size(),
                    [&](std::size_t k) { read_layer<Dim>(setting, blocks, layers[k], cells); });
}

/// From numbers of what belongs to each: where that of each begins.
void add_up(std::vector<std::size_t>& numbers) {
  std::size_t n = 0;
  for (std::size_t& number : numbers) number = std::exchange(n, n + number);
}

}  // namespace

template <int Dim>
EdgeCells<Dim>::EdgeCells(std::vector<EdgeCell<Dim>> cells, std::vector<std::uint32_t> by_index,
                          const Elements<Dim>& elements, Eigen::Index n_vertices)
    : cells_(std::move(cells)),
      by_index_(std::move(by_index)),
      first_(std::size_t(elements.rows()) + 1, 0),
      round_(std::size_t(n_vertices) + 1, 0),
      corners_(std::size_t(elements.size())) {
  for (const EdgeCell<Dim>& cell : cells_) ++first_[std::size_t(cell.element)];
  add_up(first_);
  for (const int vertex : elements.reshaped()) ++round_[std::size_t(vertex)];
  add_up(round_);
  std::vector<std::size_t> next = round_;
  for (Eigen::Index t = 0; t < elements.rows(); ++t)
    for (int i = 0; i < Dim; ++i) corners_[next[std::size_t(elements(t, i))]++] = int(t) * Dim + i;
}

template <int Dim>
EdgeCells<Dim> edge_cells(const Setting<Dim>& setting, const fem::Geometry<Dim>& geometry,
                          const Points<Dim>& normals, double reach_mm,
                          const CellBlocks<Dim>& blocks, const std::stop_token& stop) {
  const Eigen::Index n = geometry.n_elements();
  std::vector<std::vector<EdgeCell<Dim>>> parts(std::size_t((n + kElements - 1) / kElements));
  tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t part) {
    if (stop.stop_requested()) return;
    const Eigen::Index first = Eigen::Index(part) * kElements;
    for (Eigen::Index t = first; t < std::min(first + kElements, n); ++t)
      if (geometry.place(t) != fem::Place::kBorder)
        add_cells<Dim>(blocks.box, {geometry, normals, t, reach_mm}, int(t), parts[part]);
  });
  if (stop.stop_requested()) return {};
  std::vector<EdgeCell<Dim>> cells;
  std::size_t n_cells = 0;
  for (const auto& part : parts) n_cells += part.size();
  cells.reserve(n_cells);
  for (auto& part : parts) {
    cells.insert(cells.end(), part.begin(), part.end());
    std::vector<EdgeCell<Dim>>().swap(part);
  }
  std::vector<std::uint32_t> by_index = keep_nearest<Dim>(cells);
  read_values<Dim>(setting, blocks, by_index, cells);
  return {std::move(cells), std::move(by_index), geometry.elements(), geometry.n_vertices()};
}

#define SURF_INSTANTIATE(Dim)                                                                 \
  template class EdgeCells<Dim>;                                                              \
  template EdgeCells<Dim> edge_cells<Dim>(const Setting<Dim>&, const fem::Geometry<Dim>&,     \
                                          const Points<Dim>&, double, const CellBlocks<Dim>&, \
                                          const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
