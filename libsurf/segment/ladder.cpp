#include "libsurf/segment/ladder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "libsurf/segment/detail/arrival.h"

namespace surf::segment {
namespace {

constexpr int kLeastWindows = 4;
constexpr double kWidestShare = 0.8;  // of the grid: a window that holds more is the last but one
constexpr double kLargestGrowth = 1.4;
// After the last window, or where the next one was not looked at: to the whole grid, spread over
// several windows.
constexpr double kShareOfGrowth = 0.3, kLargestUnknownGrowth = 1;
constexpr int kWindowReach = 2;   // nodes from a seed to its window: a seed may be noise
constexpr int kOpeningReach = 8;  // nodes from a seed to the opening: it may be near an edge
constexpr int kMargin = 3;        // nodes, for the shell that a region is compared with
constexpr double kSlack = 1e-6;   // rounding, where an image is turned or flipped
// Of fronts: their cost per node where nothing is seen, the growth of their volumes from one to the
// next, and the radius of the one opening.
constexpr double kCalm = 0.02, kVolumeGrowth = 1.5, kFrontNeck = 1.5;
constexpr double kLargestFront = 0.4;  // of the grid
constexpr double kWidestOneSided = 3;  // [nodes] wider necks add nothing there
constexpr int kCalmReach = 3;  // nodes about a seed, of which the slope that is nothing is taken
constexpr double kSlopes = 3, kSlopeNoise = 2;

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr std::size_t kMostWindows = 18;
constexpr double kWidestOfDomain = 0.9;

template <int Dim>
std::vector<float> distances(const SeedView<Dim>& view, Family family) {
  std::vector<float> out(view.grid.box().n(), kNever);
  float least = kNever, greatest = -kNever;
  for (const SeedNodes<Dim>& seed : view.seeds) {
    least = std::min(least, float(seed.model.mean));
    greatest = std::max(greatest, float(seed.model.mean));
  }
  const std::vector<float>& intensity = view.grid.intensity();
  if (family == Family::kAlike) {
    for (const SeedNodes<Dim>& seed : view.seeds)
      for (std::size_t at = 0; at < out.size(); ++at)
        out[at] = std::min(out[at], std::abs(intensity[at] - float(seed.model.mean)));
    return out;
  }
  const bool is_limited_below = family != Family::kDarker,
             is_limited_above = family != Family::kBrighter;
  for (std::size_t at = 0; at < out.size(); ++at)
    out[at] = std::max({0.f, is_limited_below ? least - intensity[at] : 0.f,
                        is_limited_above ? intensity[at] - greatest : 0.f});
  return out;
}

/// Slope [intensity / mm] that a front takes for an edge: well above what is seen round the seeds.
template <int Dim>
double slope_of_edge(const SeedView<Dim>& view) {
  const NodeBox<Dim>& grid = view.grid.box();
  NodeBox<Dim> around;
  around.lower.fill(-kCalmReach);
  around.size.fill(2 * kCalmReach + 1);
  std::vector<double> slopes;
  for (const SeedNodes<Dim>& seed : view.seeds)
    for (const auto& center : seed.nodes)
      for (std::size_t n = 0; n < around.n(); ++n) {
        auto node = around.node(n);
        for (int axis = 0; axis < Dim; ++axis) node[axis] += center[axis];
        if (grid.contains(node)) slopes.push_back(view.grid.slope()[grid.at(node)]);
      }
  return std::max({kSlopes * median(std::move(slopes)),
                   kSlopeNoise * view.noise / view.grid.node_mm(),
                   1e-6 * view.grid.width() / view.grid.node_mm()});
}

template <int Dim>
Ladder front_ladder(const SeedView<Dim>& view, const LadderLimits<Dim>& limits) {
  const NodeBox<Dim>& grid = view.grid.box();
  Ladder out{Family::kFront, {}, {}, {kFrontNeck}, limits.most_nodes};
  std::vector<float> cost = front_cost(view, kCalm);
  if (cost.empty()) return out;
  double n_domain = double(grid.n());
  if (limits.domain) {
    n_domain = double(limits.domain->count());
    limits.domain->complement().for_each([&](std::size_t at) { cost[at] = kNever; });
  }
  std::vector<std::size_t> starts;
  for (const SeedNodes<Dim>& seed : view.seeds)
    for (const auto& node : seed.nodes) starts.push_back(grid.at(node));
  out.distance = arrival_times(grid, cost, std::span<const std::size_t>(starts),
                               std::size_t(std::min(kLargestFront * n_domain, limits.most_nodes)));
  std::vector<float> times;
  for (const float time : out.distance)
    if (std::isfinite(time)) times.push_back(time);
  std::sort(times.begin(), times.end());
  for (double n = limits.least_nodes; n < double(times.size()); n *= kVolumeGrowth)
    out.levels.push_back(times[std::size_t(n)]);
  return out;
}

/// Half-widths up to the first window that holds nearly all, which is left out.
std::vector<double> half_widths(std::vector<float> distance, double deviation, double share) {
  std::vector<double> out;
  if (distance.empty()) return out;
  const auto widest = distance.begin() + std::ptrdiff_t(share * double(distance.size()));
  std::nth_element(distance.begin(), widest, distance.end());
  if (!(deviation > 0 && *widest > 0)) return out;
  int q = 2;  // less where the ball round the seed is as varied as the rest
  while (deviation * std::pow(2, (q + kLeastWindows) / 2.0) > *widest) --q;
  for (; deviation * std::pow(2, q / 2.0) < *widest; ++q)
    out.push_back(deviation * std::pow(2, q / 2.0));
  return out;
}

/// The nodes of a set from whose centre all within r is of the set. The border of the grid counts
/// as outside, since nobody knows what lies beyond: a neck that it cuts in half is no thicker than
/// what is left of it. But along an axis of few slices all would be near the border.
template <int Dim>
NodeSet<Dim> core(const NodeBox<Dim>& grid, const NodeSet<Dim>& inside, double r) {
  NodeSet<Dim> out = inside - inside.complement().dilated(r);
  for (int axis = 0; axis < Dim; ++axis) {
    if (has_few_slices(grid, axis)) continue;
    const int reach = int(std::floor(r)), first = inside.box().lower[axis],
              size = inside.box().size[axis];
    out.erase_layers(axis, 0, std::min(size, reach - first));
    out.erase_layers(axis, std::max(0, grid.size[axis] - reach - first), size);
  }
  return out;
}

/// A core with what lies straight between it and the border of the grid, which a ball round a node
/// of the core does not fill: where an object goes on beyond the border its opening ends there as
/// it is, without a rim or a corner rounded by r.
template <int Dim>
NodeSet<Dim> up_to_border(const NodeBox<Dim>& grid, NodeSet<Dim> core, double r) {
  const NodeBox<Dim> box = core.box();
  const int reach = int(std::floor(r));
  for (int axis = 0; axis < Dim; ++axis) {
    const int size = box.size[axis];
    if (has_few_slices(grid, axis) || reach >= size) continue;
    NodeSet<Dim> low = core, high = core;
    low.erase_layers(axis, box.lower[axis] == 0 ? reach + 1 : 0, size);
    high.erase_layers(axis, 0, box.lower[axis] + size == grid.size[axis] ? size - 1 - reach : size);
    for (int step = 0; step < reach; ++step) {
      low |= low.next_along(axis);
      high |= high.previous_along(axis);
    }
    core |= low;
    core |= high;
  }
  return core;
}

/// The component of a window that holds the seeds, in its own box; of no box if there is none.
template <int Dim>
NodeSet<Dim> window_at(const SeedView<Dim>& view, const Ladder& ladder, double level) {
  const auto all = NodeSet<Dim>::where(
      view.grid.box(), [&](std::size_t at) { return ladder.distance[at] <= level * (1 + kSlack); });
  const auto starts = view.starts(all, kWindowReach);
  if (starts.empty()) return {};
  const NodeSet<Dim> out = all.component(starts);
  return out.in(out.bounds(kMargin));
}

/// The window's opening, in its own box too: it is often much smaller.
template <int Dim>
Rung<Dim> opening(const SeedView<Dim>& view, const NodeSet<Dim>& window, double r) {
  Rung<Dim> rung;
  NodeSet<Dim> deep = core(view.grid.box(), window, r);
  const auto starts = view.starts(deep, kOpeningReach);
  if (starts.empty()) return rung;
  deep = deep.component(starts);
  const NodeBox<Dim> box = deep.bounds(int(std::ceil(r)) + kMargin);
  rung.inside =
      (up_to_border(view.grid.box(), deep.in(box), r).dilated(r) & window.in(box)).filled();
  rung.neck_radius = r;
  measure(view.grid.box(), view.grid.level(), view.edge, rung);
  return rung;
}

/// @param n_component  nodes of the window's component
template <int Dim>
std::vector<Rung<Dim>> open_window(const SeedView<Dim>& view, const Ladder& ladder, double level,
                                   std::size_t& n_component, const std::stop_token& stop) {
  std::vector<Rung<Dim>> rungs(ladder.neck_radii.size());
  const NodeSet<Dim> window = window_at(view, ladder, level);
  n_component = window.count();
  if (n_component == 0) return rungs;
  for (std::size_t n = 0; n < rungs.size() && !stop.stop_requested(); ++n) {
    rungs[n] = opening(view, window, ladder.neck_radii[n]);
    rungs[n].family = ladder.family;
    rungs[n].half_width = level;
  }
  return rungs;
}

/// Scores each rung of one neck radius, by its growth in number of nodes too.
template <int Dim>
void judge(Windows<Dim>& windows, std::size_t radius, std::size_t n_grid) {
  for (std::size_t w = 0; w < windows.size(); ++w) {
    Rung<Dim>& rung = windows[w][radius];
    if (rung.n_nodes == 0) continue;
    const auto ratio = [&](std::size_t larger, std::size_t smaller) {
      return std::max(0.0, 3.0 / Dim * std::log(double(larger) / double(smaller)));
    };
    if (w > 0 && windows[w - 1][radius].n_nodes > 0)
      rung.features.growth_in = ratio(rung.n_nodes, windows[w - 1][radius].n_nodes);
    const bool has_next = w + 1 < windows.size() && windows[w + 1][radius].n_nodes > 0;
    rung.features.growth_out =
        has_next ? std::min(kLargestGrowth, ratio(windows[w + 1][radius].n_nodes, rung.n_nodes))
                 : std::min(kLargestUnknownGrowth, kShareOfGrowth * ratio(n_grid, rung.n_nodes));
    rung.score = ladder_score(rung);
  }
}

}  // namespace

template <int Dim>
std::vector<float> front_cost(const SeedView<Dim>& view, double calm) {
  const double edge = slope_of_edge(view);
  if (!(edge > 0)) return {};
  std::vector<float> out(view.grid.box().n());
  std::transform(view.grid.slope().begin(), view.grid.slope().end(), out.begin(),
                 [&](double g) { return float(calm + g / edge * (g / edge)); });
  return out;
}

template <int Dim>
Ladder make_ladder(const SeedView<Dim>& view, Family family, std::span<const double> neck_radii,
                   const LadderLimits<Dim>& limits) {
  if (family == Family::kFront) return front_ladder(view, limits);
  Ladder out{family, distances(view, family), {}, {}, limits.most_nodes};
  for (const double r : neck_radii)
    if (limits.domain || family == Family::kAlike || r <= kWidestOneSided)
      out.neck_radii.push_back(r);
  if (!limits.domain) {
    out.levels = half_widths(out.distance, view.deviation, kWidestShare);
    return out;
  }
  std::vector<float> within;
  limits.domain->for_each([&](std::size_t at) { within.push_back(out.distance[at]); });
  limits.domain->complement().for_each([&](std::size_t at) { out.distance[at] = kNever; });
  out.levels = half_widths(std::move(within), view.deviation, kWidestOfDomain);
  if (out.levels.size() > kMostWindows) out.levels.resize(kMostWindows);
  return out;
}

template <int Dim>
std::vector<Windows<Dim>> climb(const SeedView<Dim>& view, std::span<const Ladder> ladders,
                                const std::function<void(const Rung<Dim>*)>& done,
                                const std::stop_token& stop) {
  struct Task {
    std::size_t ladder, window;
  };
  std::vector<Task> tasks;
  std::vector<Windows<Dim>> out;
  for (std::size_t l = 0; l < ladders.size(); ++l) {
    out.emplace_back(ladders[l].levels.size(),
                     std::vector<Rung<Dim>>(ladders[l].neck_radii.size()));
    for (std::size_t w = 0; w < out[l].size(); ++w) tasks.push_back({l, w});
  }
  const auto most_of = [&](std::size_t l) {
    return std::size_t(
        std::min(kLargestShare * double(view.grid.box().n()), ladders[l].most_nodes));
  };
  std::vector<std::atomic<std::size_t>> last(ladders.size());  // windows that count
  for (std::size_t l = 0; l < last.size(); ++l) last[l] = out[l].size();
  tbb::parallel_for(std::size_t(0), tasks.size(), [&](std::size_t t) {
    const auto [l, w] = tasks[t];
    if (stop.stop_requested()) return;
    if (w < last[l]) {
      std::size_t n = 0;
      out[l][w] = open_window(view, ladders[l], ladders[l].levels[w], n, stop);
      std::size_t least = last[l];
      while (n > most_of(l) && w + 1 < least && !last[l].compare_exchange_weak(least, w + 1)) {
      }
    }
    const bool is_there = w < last[l] && !out[l][w].empty() && out[l][w].front().n_nodes > 0;
    done(is_there ? &out[l][w].front() : nullptr);
  });
  for (std::size_t l = 0; l < out.size(); ++l) {
    out[l].resize(last[l]);
    for (std::size_t n = 0; n < ladders[l].neck_radii.size(); ++n)
      judge(out[l], n, view.grid.box().n());
    for (auto& window : out[l])
      for (Rung<Dim>& rung : window)
        if (rung.n_nodes > most_of(l)) rung.score = 0;
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template Ladder make_ladder<Dim>(const SeedView<Dim>&, Family, std::span<const double>,      \
                                   const LadderLimits<Dim>&);                                  \
  template std::vector<float> front_cost<Dim>(const SeedView<Dim>&, double);                   \
  template std::vector<Windows<Dim>> climb<Dim>(const SeedView<Dim>&, std::span<const Ladder>, \
                                                const std::function<void(const Rung<Dim>*)>&,  \
                                                const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
