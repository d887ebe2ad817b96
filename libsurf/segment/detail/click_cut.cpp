#include "libsurf/segment/detail/click_cut.h"

#include <maxflow/graph.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <maxflow/graph.cpp>  // NOLINT(bugprone-suspicious-include): its templates
#include <numbers>

#include "libsurf/segment/detail/arrival.h"
#include "libsurf/segment/detail/out_of_memory.h"

namespace surf::segment {
namespace {

using Graph = maxflow::Graph<int, int, std::int64_t>;

constexpr double kUnit = 1 << 12;  // of the cut: capacities are whole numbers
constexpr double kHeld = 1e4;
constexpr int kBins = 100;
constexpr double kTail = 0.005;
constexpr double kLeastNoise = 0.01;   // of the range
constexpr double kOutsideClick = 0.2;  // of the faces: what one weighs in the histogram
constexpr double kUnseen = 0.02;       // added to densities: what nobody has shown
using Histogram = std::array<double, kBins>;

int bin_of(float value) { return std::min(int(value * kBins), kBins - 1); }

/// Blurred, with a mean of 1.
Histogram as_density(const Histogram& counts, double deviation) {
  const int reach = int(4 * deviation);
  Histogram out{};
  double total = 0;
  for (int b = 0; b < kBins; ++b) {
    double weight = 0;
    for (int c = b - reach; c <= b + reach; ++c) {
      const double x = (c - b) / deviation, w = std::exp(-0.5 * x * x);
      out[b] += w * counts[std::clamp(c, 0, kBins - 1)];
      weight += w;
    }
    out[b] /= weight;
    total += out[b];
  }
  for (double& density : out) density *= kBins / std::max(total, 1e-12);
  return out;
}

/// The box of the cut on its own nodes, each one or 2^Dim of the scene's.
template <int Dim>
class ClickCut {
 public:
  ClickCut(const ClickScene<Dim>& scene, const ClickCutOptions& options)
      : scene_(scene), options_(options) {
    choose_box();
    sample();
  }

  ClickCuts<Dim> run(std::span<const double> object) {
    ClickCuts<Dim> out{std::vector<NodeSet<Dim>>(object.size(), scene_.before), {}};
    if (!(high_ > low_)) return out;
    paint();
    estimate_steps();
    weigh();
    tbb::parallel_for(std::size_t(0), object.size(),
                      [&](std::size_t n) { out.inside[n] = cut(object[n]); });
    out.costs = costs_at_scene();
    return out;
  }

 private:
  /// What each node costs without the object: inside, and outside.
  void weigh() {
    const Histogram inner = density_inside(), outer = density_outside();
    const auto length = float(options_.length * noise_);
    std::array<std::vector<float>, 2> distance;
    tbb::parallel_for(0, 2, [&](int side) {
      distance[side] = distances_from(side == 0 ? inside_ : outside_, length);
    });
    const auto& [d_in, d_out] = distance;
    as_inside_.resize(grid_.n());
    as_outside_.resize(grid_.n());
    for (std::size_t at = 0; at < value_.size(); ++at) {
      const int b = bin_of(value_[at]);
      const double p = (inner[b] + kUnseen) / (inner[b] + outer[b] + 2 * kUnseen);
      const double near = std::isfinite(d_out[at])
                              ? double(d_out[at]) / std::max(double(d_in[at]) + d_out[at], 1e-9)
                              : 1;
      as_inside_[at] = float(options_.intensity * (1 - p) + options_.nearness * (1 - near));
      as_outside_[at] = float(options_.intensity * p + options_.nearness * near);
    }
  }

  NodeSet<Dim> cut(double of_object) const {
    Graph graph(int(grid_.n()), int(Dim * grid_.n()), throw_out_of_memory);
    graph.add_node(int(grid_.n()));
    const auto whole = [](double x) { return int(std::lround(x * kUnit)); };
    for (std::size_t at = 0; at < value_.size(); ++at) {
      double as_inside = as_inside_[at], as_outside = as_outside_[at];
      (object_[at] ? as_outside : as_inside) += of_object;
      if (inside_[at]) as_inside = 0, as_outside = kHeld;
      if (outside_[at]) as_inside = kHeld, as_outside = 0;
      graph.add_tweights(int(at), whole(as_outside), whole(as_inside));
    }
    for (int axis = 0; axis < Dim; ++axis)
      grid_.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
        if (here + 1 == grid_.size[axis]) return;
        const double step = value_[at + stride] - value_[at];
        const int pair = whole(std::exp(-step * step / (2 * mean_square_step_)));
        graph.add_edge(int(at), int(at + stride), pair, pair);
      });
    graph.maxflow();
    const auto cut = NodeSet<Dim>::where(grid_, [&](std::size_t at) {
      return graph.what_segment(int(at), Graph::SINK) == Graph::SOURCE;
    });
    std::vector<typename NodeBox<Dim>::Index> clicked;
    for (const std::size_t at : starts(inside_)) clicked.push_back(grid_.node(at));
    return at_scene(cut.component(clicked));
  }

  void choose_box() {
    const NodeBox<Dim>& all = scene_.box();
    if (scene_.grid.has_outside_faces()) {
      box_ = all;
      for (int axis = 0; axis < Dim; ++axis)
        is_outside_[axis] = {scene_.grid.is_outside_beyond(axis, false),
                             scene_.grid.is_outside_beyond(axis, true)};
      choose_nodes();
      return;
    }
    NodeSet<Dim> object = scene_.before;
    for (const GridClick<Dim>& click : scene_.clicks)
      if (click.side == Side::kInside)
        for (const auto& node : click.seed.nodes) object.insert(node);
    const NodeBox<Dim> tight = object.bounds(0);
    for (int axis = 0; axis < Dim; ++axis) {
      const int margin = std::max(options_.least_margin, int(options_.margin * tight.size[axis])),
                end = tight.lower[axis] + tight.size[axis];
      box_.lower[axis] = std::max(0, tight.lower[axis] - margin);
      box_.size[axis] = std::min(all.size[axis], end + margin) - box_.lower[axis];
      is_outside_[axis] = {tight.lower[axis] > 0, end < all.size[axis]};
    }
    choose_nodes();
  }

  void choose_nodes() {
    step_ = double(box_.n()) > options_.most_nodes ? 2 : 1;
    grid_.lower.fill(0);
    for (int axis = 0; axis < Dim; ++axis) grid_.size[axis] = (box_.size[axis] + step_ - 1) / step_;
  }

  /// Means of the intensities from 0 to 1, and of the object.
  void sample() {
    const std::vector<float>& intensity = scene_.grid.intensity();
    const Flags before = scene_.before.flags();
    value_.resize(grid_.n());
    object_.resize(grid_.n());
    NodeBox<Dim> part;
    for (std::size_t at = 0; at < value_.size(); ++at) {
      const auto node = grid_.node(at);
      for (int axis = 0; axis < Dim; ++axis) {
        part.lower[axis] = box_.lower[axis] + node[axis] * step_;
        part.size[axis] = std::min(step_, box_.lower[axis] + box_.size[axis] - part.lower[axis]);
      }
      double sum = 0;
      std::size_t n_object = 0;
      for (std::size_t n = 0; n < part.n(); ++n) {
        const std::size_t there = scene_.box().at(part.node(n));
        sum += intensity[there];
        n_object += before[there];
      }
      value_[at] = float(sum / double(part.n()));
      object_[at] = 2 * n_object > part.n();
    }
    std::vector<float> ranked = value_;
    const auto quantile = [&](double share) {
      const auto place = ranked.begin() + std::ptrdiff_t(share * double(ranked.size() - 1));
      std::nth_element(ranked.begin(), place, ranked.end());
      return *place;
    };
    low_ = quantile(kTail);
    high_ = quantile(1 - kTail);
    for (float& value : value_) value = std::clamp((value - low_) / (high_ - low_), 0.f, 1.f);
  }

  /// Balls at the clicks, the nearer one where they meet, of equals the later; faces outside.
  void paint() {
    inside_.assign(grid_.n(), 0);
    outside_.assign(grid_.n(), 0);
    std::vector<double> nearest(grid_.n(), std::numeric_limits<double>::infinity());
    std::vector<int> owner(grid_.n(), -1);
    const double radius = std::max(1.0, options_.brush / step_);
    for (std::size_t c = 0; c < scene_.clicks.size(); ++c)
      for (const auto& node : scene_.clicks[c].seed.nodes) {
        typename NodeBox<Dim>::Index center;
        for (int axis = 0; axis < Dim; ++axis)
          center[axis] =
              std::clamp((node[axis] - box_.lower[axis]) / step_, 0, grid_.size[axis] - 1);
        for_ball(center, radius, [&](std::size_t at, double distance) {
          if (distance > nearest[at]) return;
          nearest[at] = distance;
          owner[at] = int(c);
        });
      }
    balls_.resize(scene_.clicks.size());
    for (std::size_t at = 0; at < owner.size(); ++at) {
      if (owner[at] < 0) continue;
      balls_[owner[at]].push_back(at);
      (scene_.clicks[owner[at]].side == Side::kInside ? inside_ : outside_)[at] = 1;
    }
    for (int axis = 0; axis < Dim; ++axis)
      grid_.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
        const bool is_outside = (here == 0 && is_outside_[axis][0]) ||
                                (here + 1 == grid_.size[axis] && is_outside_[axis][1]);
        if (is_outside && !inside_[at]) outside_[at] = 1;
      });
  }

  template <class Visit>
  void for_ball(const typename NodeBox<Dim>::Index& center, double radius,
                const Visit& visit) const {
    const int reach = int(std::ceil(radius));
    NodeBox<Dim> around;
    for (int axis = 0; axis < Dim; ++axis) around.lower[axis] = center[axis] - reach;
    around.size.fill(2 * reach + 1);
    for (std::size_t n = 0; n < around.n(); ++n) {
      const auto node = around.node(n);
      if (!grid_.contains(node)) continue;
      double squared = 0;
      for (int axis = 0; axis < Dim; ++axis)
        squared += double(node[axis] - center[axis]) * (node[axis] - center[axis]);
      if (squared <= radius * radius) visit(grid_.at(node), std::sqrt(squared));
    }
  }

  void estimate_steps() {
    std::vector<float> steps;
    for (int axis = 0; axis < Dim; ++axis)
      grid_.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
        if (here + 1 < grid_.size[axis])
          steps.push_back(std::abs(value_[at + stride] - value_[at]));
      });
    double squares = 0;
    for (const float step : steps) squares += double(step) * step;
    mean_square_step_ = std::max(squares / double(std::max<std::size_t>(steps.size(), 1)), 1e-12);
    const auto middle = steps.begin() + std::ptrdiff_t(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    // The median of |a - b| of normal values of deviation s is 0.6745 sqrt(2) s.
    noise_ = steps.empty() ? kLeastNoise
                           : std::max(1.4826 * double(*middle) / std::numbers::sqrt2, kLeastNoise);
  }

  double blur() const { return std::max(1.0, noise_ * kBins); }

  /// A Gaussian for each inside click.
  Histogram density_inside() const {
    Histogram out{};
    int n_clicks = 0;
    for (std::size_t c = 0; c < balls_.size(); ++c) {
      if (scene_.clicks[c].side != Side::kInside || balls_[c].empty()) continue;
      ++n_clicks;
      double mean = 0, squares = 0;
      for (const std::size_t at : balls_[c]) mean += value_[at] / double(balls_[c].size());
      for (const std::size_t at : balls_[c]) squares += (value_[at] - mean) * (value_[at] - mean);
      const double deviation = std::max(std::sqrt(squares / double(balls_[c].size())), noise_);
      for (int b = 0; b < kBins; ++b) {
        const double x = ((b + 0.5) / kBins - mean) / deviation;
        out[b] += std::exp(-0.5 * x * x) / (deviation * std::sqrt(2 * std::numbers::pi));
      }
    }
    for (double& density : out) density /= std::max(1, n_clicks);
    return out;
  }

  Histogram density_outside() const {
    Histogram counts{};
    double n = 0;
    for (std::size_t at = 0; at < outside_.size(); ++at)
      if (outside_[at]) {
        ++counts[bin_of(value_[at])];
        ++n;
      }
    for (std::size_t c = 0; c < balls_.size(); ++c)
      if (scene_.clicks[c].side == Side::kOutside)
        for (const std::size_t at : balls_[c])
          counts[bin_of(value_[at])] += kOutsideClick * n / double(balls_[c].size());
    return as_density(counts, blur());
  }

  std::vector<float> distances_from(const Flags& flags, float length) const {
    const std::vector<std::size_t> from = starts(flags);
    return geodesic_distances(grid_, value_, std::span<const std::size_t>(from), length);
  }

  static std::vector<std::size_t> starts(const Flags& flags) {
    std::vector<std::size_t> out;
    for (std::size_t at = 0; at < flags.size(); ++at)
      if (flags[at]) out.push_back(at);
    return out;
  }

  /// Of each node of the scene that is in the box, and the cut's own that stands for it.
  template <class Visit>
  void for_nodes(const Visit& visit) const {
    for (std::size_t n = 0; n < box_.n(); ++n) {
      const auto there = box_.node(n);
      auto node = there;
      for (int axis = 0; axis < Dim; ++axis) node[axis] = (node[axis] - box_.lower[axis]) / step_;
      visit(there, node);
    }
  }

  NodeSet<Dim> at_scene(const NodeSet<Dim>& cut) const {
    NodeSet<Dim> out(scene_.box());
    for_nodes([&](const auto& there, const auto& node) {
      if (cut.contains(node)) out.insert(there);
    });
    return out;
  }

  std::vector<float> costs_at_scene() const {
    std::vector<float> out(scene_.box().n(), 0);
    for_nodes([&](const auto& there, const auto& node) {
      const std::size_t at = grid_.at(node);
      out[scene_.box().at(there)] = as_outside_[at] - as_inside_[at];
    });
    return out;
  }

  const ClickScene<Dim>& scene_;
  const ClickCutOptions& options_;
  NodeBox<Dim> box_, grid_;  // of the scene's nodes; of the cut's own
  std::array<std::array<bool, 2>, Dim> is_outside_;
  int step_ = 1;
  std::vector<float> value_;
  float low_ = 0, high_ = 0;
  Flags object_, inside_, outside_;
  std::vector<std::vector<std::size_t>> balls_;  // of the clicks
  std::vector<float> as_inside_, as_outside_;
  double noise_ = 0, mean_square_step_ = 0;
};

}  // namespace

template <int Dim>
ClickCuts<Dim> click_cuts(const ClickScene<Dim>& scene, std::span<const double> object,
                          const ClickCutOptions& options) {
  return ClickCut<Dim>(scene, options).run(object);
}

template ClickCuts<2> click_cuts<2>(const ClickScene<2>&, std::span<const double>,
                                    const ClickCutOptions&);
template ClickCuts<3> click_cuts<3>(const ClickScene<3>&, std::span<const double>,
                                    const ClickCutOptions&);

}  // namespace surf::segment
