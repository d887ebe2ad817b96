#include "libsurf/segment/settle_cut.h"

#include <maxflow/graph.h>

#include <algorithm>
#include <cmath>
#include <maxflow/graph.cpp>  // NOLINT(bugprone-suspicious-include): its templates
#include <memory>

#include "libsurf/segment/detail/node_field.h"
#include "libsurf/segment/detail/out_of_memory.h"

namespace surf::segment {
namespace {

using Graph = maxflow::Graph<int, int, std::int64_t>;

constexpr double kUnit = 1 << 16;      // of the cut: capacities are whole numbers
constexpr double kLeastPair = 0.02;    // where the intensity jumps
constexpr double kLeastWeight = 0.02;  // of the nodes next to the boundary in the means
constexpr double kLeastStep = 1e-6;    // of the largest intensity: without noise

/// With a third axis of one node in the plane.
template <int Dim>
NodeBox<3> in_space(const NodeBox<Dim>& box) {
  if constexpr (Dim == 3)
    return box;
  else
    return {{box.lower[0], box.lower[1], 0}, {box.size[0], box.size[1], 1}};
}

/// Distance to the boundary less half a node [nodes], as far as reach; positive inside.
template <int Dim>
std::vector<float> signed_distance(const NodeBox<Dim>& box, const Flags& inside, int reach) {
  Flags outside(inside.size());
  std::transform(inside.begin(), inside.end(), outside.begin(),
                 [](std::uint8_t flag) { return std::uint8_t(!flag); });
  const auto to_inside = squared_distances(box, inside, reach),
             to_outside = squared_distances(box, outside, reach);
  std::vector<float> out(inside.size());
  for (std::size_t at = 0; at < out.size(); ++at)
    out[at] = inside[at] ? std::sqrt(float(to_outside[at])) - 0.5f
                         : 0.5f - std::sqrt(float(to_inside[at]));
  return out;
}

/// Means near the wanted nodes of the values by the weights, as differences from `origin`.
template <int Dim, class Weight>
std::vector<float> local_means(const NodeBox<Dim>& box, const NodeBox<Dim>& wanted,
                               const std::vector<float>& values, double origin, double reach,
                               const Weight& weight) {
  std::vector<float> weights(values.size()), sums(values.size());
  for (std::size_t at = 0; at < values.size(); ++at) {
    weights[at] = weight(at);
    sums[at] = weights[at] * float(values[at] - origin);
  }
  blur(in_space(box).size, reach, in_space(wanted), weights);
  blur(in_space(box).size, reach, in_space(wanted), sums);
  for (std::size_t at = 0; at < values.size(); ++at) sums[at] /= weights[at] + 1e-6f;
  return sums;
}

/// The smallest box with these nodes, from 0 as their numbers count.
template <int Dim>
NodeBox<Dim> bounds_of(const NodeBox<Dim>& box, const std::vector<std::size_t>& nodes) {
  const NodeBox<Dim> from_0{{}, box.size};
  typename NodeBox<Dim>::Index lower = box.size, upper{};
  for (const std::size_t at : nodes) {
    const auto node = from_0.node(at);
    for (int axis = 0; axis < Dim; ++axis) {
      lower[axis] = std::min(lower[axis], node[axis]);
      upper[axis] = std::max(upper[axis], node[axis] + 1);
    }
  }
  return NodeBox<Dim>::between(lower, upper);
}

/// Half the median of |dI| across the boundary, at least `least`.
template <int Dim>
double edge_step(const NodeBox<Dim>& box, const Flags& inside, const std::vector<float>& intensity,
                 double least) {
  std::vector<float> steps;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      if (here + 1 < box.size[axis] && inside[at] != inside[at + stride])
        steps.push_back(std::abs(intensity[at] - intensity[at + stride]));
    });
  if (steps.empty()) return least;
  const auto middle = steps.begin() + std::ptrdiff_t(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return std::max(least, 0.5 * double(*middle));
}

int whole(double capacity) { return int(std::lround(capacity * kUnit)); }

/// The graph of the free nodes; those held count as its source (inside) and sink.
template <int Dim>
class Cut {
 public:
  /// @param free  the nodes that are
  Cut(const std::vector<Held>& held, const std::vector<std::size_t>& free)
      : held_(held), number_(held.size()) {
    const int n_free = int(free.size());
    for (int n = 0; n < n_free; ++n) number_[free[n]] = n;
    graph_ = std::make_unique<Graph>(std::max(1, n_free), std::max(1, Dim * n_free),
                                     throw_out_of_memory);
    graph_->add_node(std::max(1, n_free));
  }

  /// Of being outside if positive, of being inside if negative.
  void add_cost(std::size_t at, double cost) {
    graph_->add_tweights(number_[at], whole(std::max(cost, 0.0)), whole(std::max(-cost, 0.0)));
  }
  /// At least one of them is free.
  void add_pair(std::size_t a, std::size_t b, double cost) {
    const int capacity = whole(cost);
    if (held_[a] == Held::kFree && held_[b] == Held::kFree)
      graph_->add_edge(number_[a], number_[b], capacity, capacity);
    else
      tie(held_[a] == Held::kFree ? a : b, held_[a] == Held::kFree ? b : a, capacity);
  }
  Flags least() {
    graph_->maxflow();
    Flags out(held_.size());
    for (std::size_t at = 0; at < out.size(); ++at)
      out[at] = held_[at] == Held::kFree
                    ? graph_->what_segment(number_[at], Graph::SINK) == Graph::SOURCE
                    : held_[at] == Held::kInside;
    return out;
  }

 private:
  void tie(std::size_t free, std::size_t held, int capacity) {
    const bool is_inside = held_[held] == Held::kInside;
    graph_->add_tweights(number_[free], is_inside ? capacity : 0, is_inside ? 0 : capacity);
  }

  const std::vector<Held>& held_;
  std::vector<int> number_;
  std::unique_ptr<Graph> graph_;
};

}  // namespace

template <int Dim>
Flags settled(const NodeBox<Dim>& box, const Flags& inside, const std::vector<float>& intensity,
              const std::vector<Held>& held, double noise, const std::vector<float>& costs,
              const SettleOptions& options) {
  const std::vector<float> depth =
      signed_distance(box, inside, std::max(options.width, options.shell) + 1);
  const auto [lowest, highest] = std::minmax_element(intensity.begin(), intensity.end());
  const double origin = 0.5 * (double(*lowest) + *highest),
               least_step = std::max(2 * noise, kLeastStep * (double(*highest) - *lowest));
  if (!(least_step > 0)) return inside;
  std::vector<Held> of_node(box.n());
  std::vector<std::size_t> free;
  for (std::size_t at = 0; at < of_node.size(); ++at) {
    if (!held.empty() && held[at] != Held::kFree)
      of_node[at] = held[at];
    else if (std::abs(depth[at]) >= float(options.width))
      of_node[at] = inside[at] ? Held::kInside : Held::kOutside;
    else
      free.push_back(at);
  }
  Cut<Dim> cut(of_node, free);
  if (free.empty()) return cut.least();
  const NodeBox<Dim> wanted = bounds_of(box, free);
  const auto inner = local_means(
      box, wanted, intensity, origin, options.reach,
      [&](std::size_t at) { return inside[at] ? float(kLeastWeight + (depth[at] > 0.5f)) : 0.f; });
  const auto outer =
      local_means(box, wanted, intensity, origin, options.reach, [&](std::size_t at) {
        return depth[at] > 0 || depth[at] < 0.5f - float(options.shell)
                   ? 0.f
                   : float(kLeastWeight + (depth[at] < -0.5f));
      });
  for (const std::size_t at : free) {
    const double I = intensity[at] - origin, m_in = inner[at], m_out = outer[at],
                 contrast = std::max(std::abs(m_in - m_out), least_step),
                 fit = 2 * ((I - m_out) * (I - m_out) - (I - m_in) * (I - m_in)) /
                       (contrast * contrast);
    cut.add_cost(at, std::clamp(fit, -options.clip, options.clip) + options.hold * depth[at] +
                         (costs.empty() ? 0 : double(costs[at])));
  }
  const double step = edge_step(box, inside, intensity, least_step);
  const auto add_pair = [&](std::size_t first, std::size_t second) {
    const double jump = (intensity[second] - intensity[first]) / step;
    cut.add_pair(first, second, options.pair * std::exp(-0.5 * jump * jump) + kLeastPair);
  };
  for (int axis = 0; axis < Dim; ++axis) {
    const std::size_t stride = box.stride(axis), size = std::size_t(box.size[axis]);
    for (const std::size_t at : free) {
      const std::size_t here = at / stride % size;
      if (here + 1 < size) add_pair(at, at + stride);
      if (here > 0 && of_node[at - stride] != Held::kFree) add_pair(at - stride, at);
    }
  }
  return cut.least();
}

#define SURF_INSTANTIATE(Dim)                                                               \
  template Flags settled<Dim>(const NodeBox<Dim>&, const Flags&, const std::vector<float>&, \
                              const std::vector<Held>&, double, const std::vector<float>&,  \
                              const SettleOptions&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
