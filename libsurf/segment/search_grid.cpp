#include "libsurf/segment/search_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "libsurf/base/usual_range.h"

namespace surf::segment {
namespace {

constexpr std::size_t kSome = 1 << 14;  // nodes, that tell the range of all

constexpr double kBlur = 0.55;  // nodes, the Gaussian's and the spline's: more hides thin walls
constexpr double kSplineVariance = 1.0 / 3;  // cells^2
// Of a node: what a last step may be shorter by. Headers are rounded to six digits, so that the
// same voxels may seem to reach a little beyond a whole number of nodes.
constexpr double kSlack = 0.01;

constexpr double kRounding = 1e-5;  // of equal slopes: an edge midway between nodes is at both
constexpr int kEdgeMargin = 3;      // nodes round a part, in which its edges are looked for
// Of the grid: a larger part is not made without the rest. 73^3 nodes of 1.5 million are.
constexpr double kMostAlone = 0.3;

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
    first[axis] = std::clamp(int(std::floor(node[axis])), box.lower[axis], box.upper()[axis] - 2);
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

template <int Dim>
NodeBox<Dim> widened(const NodeBox<Dim>& part, int by, const NodeBox<Dim>& grid) {
  typename NodeBox<Dim>::Index lower, upper;
  for (int axis = 0; axis < Dim; ++axis) {
    lower[axis] = std::max(part.lower[axis] - by, 0);
    upper[axis] = std::min(part.upper()[axis] + by, grid.size[axis]);
  }
  return NodeBox<Dim>::between(lower, upper);
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
    is_outside_beyond[axis] = {part.lower[axis] > 0, part.upper()[axis] < extent.size[axis]};
  }
  node_to_world = extent.index_to_world *
                  Eigen::Translation<double, Dim>(point_of<Dim>(part.lower)) * Eigen::Scaling(step);
}

template <int Dim>
SearchGrid<Dim>::SearchGrid(const Field<Dim>& I, const ImageExtent<Dim>& extent,
                            const SearchLattice<Dim>& lattice)
    : lattice_(lattice),
      usual_(extent.usual),
      rounded_to_(extent.rounded_to),
      values_(made(I, lattice.box, {})) {}

template <int Dim>
SearchGrid<Dim>::SearchGrid(std::shared_ptr<const Field<Dim>> I, const ImageExtent<Dim>& extent,
                            const SearchLattice<Dim>& lattice)
    : lattice_(lattice), usual_(extent.usual), rounded_to_(extent.rounded_to), I_(std::move(I)) {}

template <int Dim>
SearchGrid<Dim>::SearchGrid(const SearchGrid& whole, const SearchLattice<Dim>& lattice,
                            std::shared_ptr<const Values> values)
    : lattice_(lattice),
      usual_(whole.usual_),
      rounded_to_(whole.rounded_to_),
      values_(std::move(values)) {}

template <int Dim>
bool SearchGrid<Dim>::make_all(const std::stop_token& stop) const {
  if (values_) return true;
  const auto all = made(*I_, box(), stop);
  if (stop.stop_requested()) return false;
  values_ = all;
  I_.reset();
  return true;
}

template <int Dim>
SearchGrid<Dim> SearchGrid<Dim>::part(const NodeBox<Dim>& part, const std::stop_token& stop) const {
  if (!values_) n_alone_ += part.n();
  if (double(part.n()) > kMostAlone * double(box().n()) || n_alone_ > box().n()) make_all(stop);
  SearchLattice<Dim> lattice = lattice_;
  lattice.box.size = part.size;
  for (int axis = 0; axis < Dim; ++axis) {
    const std::array is_shared{part.lower[axis] == 0, part.upper()[axis] == box().size[axis]};
    for (const int face : {0, 1}) {
      lattice.is_outside_beyond[axis][face] &= is_shared[face];
      lattice.goes_on_beyond[axis][face] |= !is_shared[face];
    }
  }
  lattice.node_to_world =
      node_to_world() * Eigen::Translation<double, Dim>(point_of<Dim>(part.lower));
  if (!values_) return {*this, lattice, made(*I_, part, stop)};
  Values out{cropped(box(), values_->intensity, part),
             cropped(box(), values_->slope, part),
             cropped(box(), values_->edge_slope, part),
             {}};
  out.level = levels(out.intensity);
  return {*this, lattice, std::make_shared<Values>(std::move(out))};
}

template <int Dim>
std::size_t SearchGrid<Dim>::memory_bytes() const {
  if (!values_) return 0;
  return (values_->intensity.capacity() + values_->slope.capacity() +
          values_->edge_slope.capacity()) *
             sizeof(float) +
         values_->level.capacity() * sizeof(std::uint16_t);
}

template <int Dim>
bool SearchGrid<Dim>::has_outside_faces() const {
  return std::any_of(lattice_.is_outside_beyond.begin(), lattice_.is_outside_beyond.end(),
                     [](const auto& faces) { return faces[0] || faces[1]; });
}

template <int Dim>
bool SearchGrid<Dim>::is_cut_off(const NodeBox<Dim>& object) const {
  for (int axis = 0; axis < Dim; ++axis)
    if ((object.lower[axis] == 0 && lattice_.goes_on_beyond[axis][0]) ||
        (object.upper()[axis] == box().size[axis] && lattice_.goes_on_beyond[axis][1]))
      return true;
  return false;
}

/// Of a box of the grid; not whole after a stop.
template <int Dim>
auto SearchGrid<Dim>::made(const Field<Dim>& I, const NodeBox<Dim>& part,
                           const std::stop_token& stop) const -> std::shared_ptr<Values> {
  const NodeBox<Dim> seen = widened(part, kEdgeMargin, box());
  Values all;
  all.intensity.resize(seen.n());
  all.slope.resize(seen.n());
  Directions direction(seen.n());  // one node far, in nodes
  const Eigen::Matrix<double, Dim, Dim> to_nodes =
      lattice_.node_mm * lattice_.node_to_world.linear().inverse();
  const std::size_t slice = seen.n() / seen.size[Dim - 1];
  tbb::parallel_for(0, seen.size[Dim - 1], [&](int k) {
    if (stop.stop_requested()) return;
    Points<Dim> x(Eigen::Index(slice), Dim);
    for (std::size_t m = 0; m < slice; ++m)
      x.row(Eigen::Index(m)) =
          (lattice_.node_to_world * point_of<Dim>(seen.node(k * slice + m))).transpose();
    Samples<Dim> samples;
    I.sample(x, Derivatives::kFirst, samples);
    for (std::size_t m = 0; m < slice; ++m) {
      const Vector<Dim> gradient = samples.gradient.row(Eigen::Index(m)).transpose();
      all.intensity[k * slice + m] = static_cast<float>(samples.value[Eigen::Index(m)]);
      all.slope[k * slice + m] = static_cast<float>(gradient.norm());
      direction[k * slice + m] = (to_nodes * gradient.normalized()).template cast<float>();
    }
  });
  all.edge_slope.assign(seen.n(), 0);
  if (!stop.stop_requested()) keep_edges(seen, direction, all);
  auto out = std::make_shared<Values>(std::move(all));
  if (seen.n() != part.n()) {
    out->intensity = cropped(seen, out->intensity, part);
    out->slope = cropped(seen, out->slope, part);
    out->edge_slope = cropped(seen, out->edge_slope, part);
  }
  out->level = levels(out->intensity);
  return out;
}

template <int Dim>
std::vector<std::uint16_t> SearchGrid<Dim>::levels(const std::vector<float>& intensity) const {
  const auto [lowest, highest] = std::minmax_element(intensity.begin(), intensity.end());
  // Of these nodes, not of the image: a small bright object is more than a few of those near it.
  std::vector<float> some;
  for (std::size_t at = 0; at < intensity.size(); at += intensity.size() / kSome + 1)
    some.push_back(intensity[at]);
  const auto [low, high] = usual_range({*lowest, *highest}, std::move(some));
  const double scale = (kLevels - 1) / std::max(double(high) - low, 1e-300);
  std::vector<std::uint16_t> out(intensity.size());
  std::transform(intensity.begin(), intensity.end(), out.begin(), [&](float value) {
    return std::uint16_t(std::lround(scale * (std::clamp(value, low, high) - double(low))));
  });
  return out;
}

/// Not at the border of the grid, where the gradient is the spline's own, but where there are few
/// slices all would be near it.
template <int Dim>
void SearchGrid<Dim>::keep_edges(const NodeBox<Dim>& part, const Directions& direction,
                                 Values& values) const {
  const auto is_at_border = [&](const typename NodeBox<Dim>::Index& node) {
    for (int axis = 0; axis < Dim; ++axis)
      if (!has_few_slices(box(), axis) && (node[axis] == 0 || node[axis] + 1 == box().size[axis]))
        return true;
    return false;
  };
  const std::vector<float>& slope = values.slope;
  const std::size_t slice = part.n() / part.size[Dim - 1];
  tbb::parallel_for(0, part.size[Dim - 1], [&](int k) {
    for (std::size_t at = k * slice; at < (k + 1) * slice; ++at) {
      const auto node = part.node(at);
      if (!(slope[at] > 0) || is_at_border(node)) continue;
      const Vector<Dim> here = point_of<Dim>(node), up = direction[at].template cast<double>();
      const double highest = std::max(interpolated<Dim>(part, slope, here + up),
                                      interpolated<Dim>(part, slope, here - up));
      if (slope[at] * (1 + kRounding) >= highest) values.edge_slope[at] = slope[at];
    }
  });
}

template struct SearchLattice<2>;
template struct SearchLattice<3>;
template class SearchGrid<2>;
template class SearchGrid<3>;

}  // namespace surf::segment
