#include "libsurf/segment/search_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surf::segment {
namespace {

constexpr double kBlur = 0.55;  // nodes, the Gaussian's and the spline's: more hides thin walls
constexpr double kSplineVariance = 1.0 / 3;  // cells^2
// Of a node: what a last step may be shorter by. Headers are rounded to six digits, so that the
// same voxels may seem to reach a little beyond a whole number of nodes.
constexpr double kSlack = 0.01;

constexpr double kRounding = 1e-5;  // of equal slopes: an edge midway between nodes is at both

template <int Dim>
Vector<Dim> point_of(const typename NodeBox<Dim>::Index& node) {
  Vector<Dim> out;
  for (int axis = 0; axis < Dim; ++axis) out[axis] = node[axis];
  return out;
}

/// Linear between the nodes, beyond the box as at its border.
template <int Dim>
double interpolated(const NodeBox<Dim>& box, const std::vector<float>& values,
                    const Vector<Dim>& node) {
  typename NodeBox<Dim>::Index first;
  Vector<Dim> t;
  for (int axis = 0; axis < Dim; ++axis) {
    first[axis] = std::clamp(int(node[axis]), 0, box.size[axis] - 2);
    t[axis] = std::clamp(node[axis] - first[axis], 0.0, 1.0);
  }
  double out = 0;
  for (int corner = 0; corner < 1 << Dim; ++corner) {
    auto at = first;
    double weight = 1;
    for (int axis = 0; axis < Dim; ++axis) {
      const int bit = corner >> axis & 1;
      at[axis] += bit;
      weight *= bit ? t[axis] : 1 - t[axis];
    }
    out += weight * values[box.at(at)];
  }
  return out;
}

}  // namespace

template <int Dim>
SearchLattice<Dim>::SearchLattice(const ImageExtent<Dim>& extent, double max_nodes,
                                  const std::optional<NodeBox<Dim>>& cells) {
  const NodeBox<Dim> part = cells.value_or(NodeBox<Dim>{{}, extent.size});
  const Vector<Dim> spacing = extent.index_to_world.linear().colwise().norm().transpose();
  double content = 1;
  for (int axis = 0; axis < Dim; ++axis) content *= spacing[axis] * part.size[axis];
  const double cell = extent.cell_mm();
  node_mm = std::max(cell, std::pow(content / max_nodes, 1.0 / Dim));
  sigma_mm =
      std::sqrt(std::max(0.0, kBlur * kBlur * node_mm * node_mm - kSplineVariance * cell * cell));
  Vector<Dim> step;  // cells, so that the last node is the last cell
  for (int axis = 0; axis < Dim; ++axis) {
    const int n_steps =
        std::max(1, int(std::ceil((part.size[axis] - 1) * spacing[axis] / node_mm - kSlack)));
    step[axis] = double(part.size[axis] - 1) / n_steps;
    box.size[axis] = n_steps + 1;
    is_outside_beyond[axis] = {part.lower[axis] > 0,
                               part.lower[axis] + part.size[axis] < extent.size[axis]};
  }
  node_to_world = extent.index_to_world *
                  Eigen::Translation<double, Dim>(point_of<Dim>(part.lower)) * Eigen::Scaling(step);
}

template <int Dim>
SearchGrid<Dim>::SearchGrid(const Field<Dim>& I, const ImageExtent<Dim>& extent,
                            const SearchLattice<Dim>& lattice, const std::stop_token& stop)
    : lattice_(lattice), range_(double(extent.range[1]) - extent.range[0]) {
  const NodeBox<Dim>& box = lattice_.box;
  intensity_.resize(box.n());
  slope_.resize(box.n());
  std::vector<Eigen::Matrix<float, Dim, 1>> direction(box.n());  // one node far, in nodes
  const Eigen::Matrix<double, Dim, Dim> to_nodes =
      lattice_.node_mm * lattice_.node_to_world.linear().inverse();
  const std::size_t slice = box.n() / box.size[Dim - 1];
  tbb::parallel_for(0, box.size[Dim - 1], [&](int k) {
    if (stop.stop_requested()) return;
    Points<Dim> x(Eigen::Index(slice), Dim);
    for (std::size_t m = 0; m < slice; ++m)
      x.row(Eigen::Index(m)) =
          (lattice_.node_to_world * point_of<Dim>(box.node(k * slice + m))).transpose();
    Samples<Dim> samples;
    I.sample(x, Derivatives::kFirst, samples);
    for (std::size_t m = 0; m < slice; ++m) {
      const Vector<Dim> gradient = samples.gradient.row(Eigen::Index(m)).transpose();
      intensity_[k * slice + m] = static_cast<float>(samples.value[Eigen::Index(m)]);
      slope_[k * slice + m] = static_cast<float>(gradient.norm());
      direction[k * slice + m] = (to_nodes * gradient.normalized()).template cast<float>();
    }
  });
  is_whole_ = !stop.stop_requested();
  if (!is_whole_) return;
  keep_edges(direction);
  const auto [lowest, highest] = std::minmax_element(intensity_.begin(), intensity_.end());
  const double low = *lowest, scale = (kLevels - 1) / std::max(double(*highest) - low, 1e-300);
  level_.resize(box.n());
  std::transform(intensity_.begin(), intensity_.end(), level_.begin(),
                 [&](float value) { return std::uint16_t(std::lround(scale * (value - low))); });
}

template <int Dim>
SearchGrid<Dim>::SearchGrid(const SearchGrid& whole, const NodeBox<Dim>& part)
    : lattice_(whole.lattice_),
      range_(whole.range_),
      intensity_(cropped(whole.box(), whole.intensity_, part)),
      slope_(cropped(whole.box(), whole.slope_, part)),
      edge_slope_(cropped(whole.box(), whole.edge_slope_, part)),
      level_(cropped(whole.box(), whole.level_, part)) {
  lattice_.box.size = part.size;
  for (int axis = 0; axis < Dim; ++axis) {
    lattice_.is_outside_beyond[axis][0] &= part.lower[axis] == 0;
    lattice_.is_outside_beyond[axis][1] &=
        part.lower[axis] + part.size[axis] == whole.box().size[axis];
  }
  lattice_.node_to_world =
      whole.node_to_world() * Eigen::Translation<double, Dim>(point_of<Dim>(part.lower));
}

template <int Dim>
bool SearchGrid<Dim>::has_outside_faces() const {
  return std::any_of(lattice_.is_outside_beyond.begin(), lattice_.is_outside_beyond.end(),
                     [](const auto& faces) { return faces[0] || faces[1]; });
}

/// Not at the border, where the gradient is the spline's own, but where there are few slices all
/// would be near it.
template <int Dim>
void SearchGrid<Dim>::keep_edges(const std::vector<Eigen::Matrix<float, Dim, 1>>& direction) {
  const NodeBox<Dim>& box = lattice_.box;
  edge_slope_.assign(box.n(), 0);
  const auto is_at_border = [&](const typename NodeBox<Dim>::Index& node) {
    for (int axis = 0; axis < Dim; ++axis)
      if (!has_few_slices(box, axis) && (node[axis] == 0 || node[axis] + 1 == box.size[axis]))
        return true;
    return false;
  };
  const std::size_t slice = box.n() / box.size[Dim - 1];
  tbb::parallel_for(0, box.size[Dim - 1], [&](int k) {
    for (std::size_t at = k * slice; at < (k + 1) * slice; ++at) {
      const auto node = box.node(at);
      if (!(slope_[at] > 0) || is_at_border(node)) continue;
      const Vector<Dim> here = point_of<Dim>(node), up = direction[at].template cast<double>();
      const double highest = std::max(interpolated<Dim>(box, slope_, here + up),
                                      interpolated<Dim>(box, slope_, here - up));
      if (slope_[at] * (1 + kRounding) >= highest) edge_slope_[at] = slope_[at];
    }
  });
}

template struct SearchLattice<2>;
template struct SearchLattice<3>;
template class SearchGrid<2>;
template class SearchGrid<3>;

}  // namespace surf::segment
