#include "libsurf/segment/region_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <thread>

#include "libsurf/segment/seed_model.h"

namespace surf::segment {
namespace {

constexpr int kLeastWindows = 4;
constexpr double kWidestShare = 0.8;  // of the grid: a window that holds more is the last but one
constexpr double kLeastRadius = 3;    // of a ball [nodes]: smaller is not judged
constexpr double kLargestGrowth = 1.4;
// After the last window, or where the next one was not looked at: to the whole grid, spread over
// several windows.
constexpr double kShareOfGrowth = 0.3, kLargestUnknownGrowth = 1;
constexpr int kWindowReach = 2;   // nodes from a seed to its window: a seed may be noise
constexpr int kOpeningReach = 8;  // nodes from a seed to the opening: it may be near an edge
constexpr int kShell = 2;         // nodes, outside: what the inside is compared with
constexpr double kEdgeNoise = 3;  // an edge is that many times the noise, per node
// Of the range, since phantoms have no noise: the finest step of the search.
constexpr double kLeastDeviation = 1.0 / 4096;
constexpr int kLevels = SearchGrid<3>::kLevels;
constexpr double kSlack = 1e-6;  // rounding, where an image is turned or flipped

template <int Dim>
using Index = typename NodeBox<Dim>::Index;

/// A seed: the nodes nearest to it, and what the image is like there.
template <int Dim>
struct SeedNodes {
  std::vector<Index<Dim>> nodes;
  SeedModel model;
};

template <int Dim>
SeedNodes<Dim> seed_nodes(const SearchGrid<Dim>& grid, const Vector<Dim>& seed) {
  SeedNodes<Dim> out{nearest_nodes<Dim>(grid.node_to_world().inverse() * seed, grid.box().size),
                     estimate_seed_model<Dim>(grid, seed)};
  out.model.deviation = std::max(out.model.deviation, kLeastDeviation * grid.range());
  return out;
}

/// The flagged nodes nearest to each seed, within reach: of equally near ones all.
template <int Dim>
std::vector<std::size_t> starts(const NodeBox<Dim>& box, const Flags& flags,
                                std::span<const SeedNodes<Dim>> seeds, int reach) {
  NodeBox<Dim> around;
  around.lower.fill(-reach);
  around.size.fill(2 * reach + 1);
  std::vector<std::size_t> out;
  for (const SeedNodes<Dim>& seed : seeds) {
    int nearest = reach * reach;
    std::vector<std::size_t> found;
    for (const Index<Dim>& center : seed.nodes)
      for (std::size_t at = 0; at < around.n(); ++at) {
        Index<Dim> node = around.node(at);
        int squared = 0;
        for (int axis = 0; axis < Dim; ++axis) {
          squared += node[axis] * node[axis];
          node[axis] += center[axis];
        }
        if (squared > nearest || !box.contains(node) || !flags[box.at(node)]) continue;
        if (squared < nearest) found.clear();
        nearest = squared;
        found.push_back(box.at(node));
      }
    out.insert(out.end(), found.begin(), found.end());
  }
  return out;
}

/// A window's opening: its nodes, and what they look like.
template <int Dim>
struct Rung {
  double half_width = 0, neck_radius = 0;  ///< [intensity], [nodes]
  NodeBox<Dim> box;                        ///< leaves a margin, but at the border of the grid
  std::vector<bool> inside;
  std::size_t n_nodes = 0;
  RungFeatures features;
  double border_share = 0;  ///< of the length or area
  double score = 0;
};

/// Circle or ball of equal content: its length or area over the region's. A node's face counts
/// pi / 4 or 2 / 3: that is what a grid makes of a smooth curve or surface, averaged over
/// directions.
template <int Dim>
double sphericity(double n_nodes, double n_faces) {
  if constexpr (Dim == 2)
    return 2 * std::sqrt(std::numbers::pi * n_nodes) / (std::numbers::pi / 4 * n_faces);
  else
    return std::cbrt(36 * std::numbers::pi) * std::pow(n_nodes, 2.0 / 3) / (2 * n_faces / 3);
}

/// Fills in what the boundary of the nodes inside looks like.
/// @param level, edge  at the nodes of the box
template <int Dim>
void measure(const NodeBox<Dim>& box, const Flags& inside, const std::vector<std::uint16_t>& level,
             const Flags& edge, Rung<Dim>& rung) {
  const std::vector<std::int16_t> distance = squared_distances(box, inside, kShell);
  std::vector<int> object(kLevels), shell(kLevels);
  for (std::size_t at = 0; at < box.n(); ++at)
    if (distance[at] <= kShell * kShell) ++(inside[at] ? object : shell)[level[at]];
  std::size_t n_faces = 0, n_on_edge = 0, n_on_border = 0;
  for (int axis = 0; axis < Dim; ++axis)
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t stride) {
      const bool is_last = here + 1 == box.size[axis];
      if (inside[at]) n_on_border += (here == 0) + is_last;
      if (is_last || inside[at] == inside[at + stride]) return;
      ++n_faces;
      n_on_edge += edge[at] || edge[at + stride];
    });
  n_faces += n_on_border;
  rung.n_nodes = std::accumulate(object.begin(), object.end(), std::size_t(0));
  rung.border_share = double(n_on_border) / double(n_faces);
  rung.features.separation = histogram_separation(object, shell);
  rung.features.edge_share = double(n_on_edge) / double(n_faces);
  rung.features.sphericity = sphericity<Dim>(double(rung.n_nodes), double(n_faces));
}

/// As of the formula of RungFeatures, but what the scan cuts off is less likely to be meant, of
/// two that are equal the larger one is, and the separation counts for more. The exponents lie in
/// the middle of those that find most of 32 structures in 13 scans.
template <int Dim>
double score(const Rung<Dim>& rung) {
  return rung.features.score() * std::pow(rung.features.separation, 0.3) *
         std::pow(double(rung.n_nodes), 0.09 / Dim) * std::exp(-rung.border_share);
}

/// Squared distances to the outside, and to the border of the grid, beyond which nobody knows: a
/// neck that the border cuts in half is no thicker than what is left of it. But along an axis of
/// few slices all would be near the border.
template <int Dim>
std::vector<std::int16_t> depths(const NodeBox<Dim>& grid, const NodeBox<Dim>& box,
                                 const Flags& outside, int reach) {
  std::vector<std::int16_t> out = squared_distances(box, outside, reach);
  for (int axis = 0; axis < Dim; ++axis) {
    if (has_few_slices(grid, axis)) continue;
    box.for_lines(axis, [&](std::size_t at, int here, std::size_t) {
      const int node = box.lower[axis] + here;
      const int to_border = std::min({node + 1, grid.size[axis] - node, reach + 1});
      out[at] = std::min(out[at], std::int16_t(to_border * to_border));
    });
  }
  return out;
}

/// What the search looks at: the grid as seen from the seeds.
template <int Dim>
struct View {
  const SearchGrid<Dim>& grid;
  std::vector<SeedNodes<Dim>> seeds;
  std::vector<float> distance;  ///< of the intensity at each node from the nearest seed's mean
  Flags edge;                   ///< above the noise

  View(const SearchGrid<Dim>& search_grid, std::span<const Vector<Dim>> seeds_mm)
      : grid(search_grid) {
    for (const Vector<Dim>& seed : seeds_mm) seeds.push_back(seed_nodes<Dim>(grid, seed));
    double noise = 0;
    distance.assign(grid.box().n(), std::numeric_limits<float>::infinity());
    for (const SeedNodes<Dim>& seed : seeds) {
      noise = std::max(noise, seed.model.noise);
      for (std::size_t at = 0; at < distance.size(); ++at)
        distance[at] =
            std::min(distance[at], std::abs(grid.intensity()[at] - float(seed.model.mean)));
    }
    const double least = kEdgeNoise * noise / grid.node_mm();
    edge.resize(distance.size());
    std::transform(grid.edge_slope().begin(), grid.edge_slope().end(), edge.begin(),
                   [&](float slope) { return std::uint8_t(slope > least); });
  }

  double deviation() const {
    double out = std::numeric_limits<double>::infinity();
    for (const SeedNodes<Dim>& seed : seeds) out = std::min(out, seed.model.deviation);
    return out;
  }
};

/// The openings of one window, one for each neck radius; those that are nowhere have no node.
template <int Dim>
std::vector<Rung<Dim>> open_window(const View<Dim>& view, double half_width,
                                   std::span<const double> neck_radii,
                                   const std::stop_token& stop) {
  const NodeBox<Dim>& grid = view.grid.box();
  std::vector<Rung<Dim>> rungs(neck_radii.size());
  Flags window(grid.n());
  std::transform(view.distance.begin(), view.distance.end(), window.begin(),
                 [&](float d) { return std::uint8_t(d <= half_width * (1 + kSlack)); });
  auto window_starts = starts<Dim>(grid, window, view.seeds, kWindowReach);
  if (window_starts.empty()) return rungs;
  window = component(grid, window, std::move(window_starts));
  const NodeBox<Dim> box = bounds(grid, window, int(std::ceil(kShell)) + 1);
  window = cropped(grid, window, box);
  const std::vector<std::uint16_t> level = cropped(grid, view.grid.level(), box);
  const Flags edge = cropped(grid, view.edge, box);
  Flags outside(box.n());
  std::transform(window.begin(), window.end(), outside.begin(),
                 [](std::uint8_t flag) { return std::uint8_t(!flag); });
  const int reach = int(std::ceil(*std::max_element(neck_radii.begin(), neck_radii.end())));
  const std::vector<std::int16_t> depth = depths(grid, box, outside, reach);
  for (std::size_t n = 0; n < rungs.size() && !stop.stop_requested(); ++n) {
    const double r = neck_radii[n];
    Flags core(box.n());
    std::transform(depth.begin(), depth.end(), core.begin(),
                   [&](int d) { return std::uint8_t(d > r * r); });
    auto core_starts = starts<Dim>(box, core, view.seeds, kOpeningReach);
    if (core_starts.empty()) continue;
    core = component(box, core, std::move(core_starts));
    const std::vector<std::int16_t> to_core = squared_distances(box, core, int(std::ceil(r)));
    Flags inside(box.n());
    for (std::size_t at = 0; at < box.n(); ++at) inside[at] = window[at] && to_core[at] <= r * r;
    fill_holes(box, inside);
    Rung<Dim>& rung = rungs[n];
    rung.half_width = half_width;
    rung.neck_radius = r;
    rung.box = box;
    rung.inside.assign(inside.begin(), inside.end());
    measure(box, inside, level, edge, rung);
  }
  return rungs;
}

/// Half-widths up to the first window that holds nearly all, which is left out.
std::vector<double> half_widths(std::vector<float> distance, double deviation) {
  const auto widest = distance.begin() + std::ptrdiff_t(kWidestShare * double(distance.size()));
  std::nth_element(distance.begin(), widest, distance.end());
  std::vector<double> out;
  if (!(deviation > 0 && *widest > 0)) return out;
  int q = 2;  // less where the ball round the seed is as varied as the rest
  while (deviation * std::pow(2, (q + kLeastWindows) / 2.0) > *widest) --q;
  for (; deviation * std::pow(2, q / 2.0) < *widest; ++q)
    out.push_back(deviation * std::pow(2, q / 2.0));
  return out;
}

/// The rungs of each window, and of the stop or the end of a search those that were done.
template <int Dim>
std::vector<std::vector<Rung<Dim>>> open_windows(const View<Dim>& view,
                                                 const std::vector<double>& widths,
                                                 const SearchOptions& options,
                                                 const SearchProgress& progress,
                                                 const std::stop_token& outer_stop) {
  std::vector<std::vector<Rung<Dim>>> windows(widths.size(),
                                              std::vector<Rung<Dim>>(options.neck_radii.size()));
  std::stop_source stop;
  const std::stop_callback forwarded(outer_stop, [&] { stop.request_stop(); });
  std::atomic<int> n_done = 0;
  const auto caller = std::this_thread::get_id();
  tbb::parallel_for(std::size_t(0), widths.size(), [&](std::size_t w) {
    if (stop.stop_requested()) return;
    windows[w] = open_window(view, widths[w], options.neck_radii, stop.get_token());
    ++n_done;
    if (progress && std::this_thread::get_id() == caller && !progress(n_done)) stop.request_stop();
  });
  return windows;
}

/// Scores each rung of one neck radius, by its growth in number of nodes too.
template <int Dim>
void judge(std::vector<std::vector<Rung<Dim>>>& windows, std::size_t radius, std::size_t n_grid) {
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
    rung.score = score(rung);
  }
}

/// Dice.
template <int Dim>
double overlap(const Rung<Dim>& a, const Rung<Dim>& b) {
  const double most = 2 * double(std::min(a.n_nodes, b.n_nodes)) / double(a.n_nodes + b.n_nodes);
  if (most <= SearchOptions::kMostOverlap) return most;
  std::size_t n_both = 0;
  for (std::size_t at = 0; at < a.inside.size(); ++at) {
    if (!a.inside[at]) continue;
    const auto node = a.box.node(at);
    n_both += b.box.contains(node) && b.inside[b.box.at(node)];
  }
  return 2 * double(n_both) / double(a.n_nodes + b.n_nodes);
}

/// The best rungs that differ.
template <int Dim>
std::vector<const Rung<Dim>*> choose(const std::vector<std::vector<Rung<Dim>>>& windows,
                                     int max_regions) {
  const double unit_ball = Dim == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3;
  std::vector<const Rung<Dim>*> best, chosen;
  for (std::size_t n = 0; !windows.empty() && n < windows.front().size(); ++n)
    for (const auto& window : windows)
      if (double(window[n].n_nodes) >= unit_ball * std::pow(kLeastRadius, Dim))
        best.push_back(&window[n]);
  std::stable_sort(best.begin(), best.end(),
                   [](const auto* a, const auto* b) { return a->score > b->score; });
  for (const Rung<Dim>* rung : best) {
    if (int(chosen.size()) == max_regions) break;
    if (std::none_of(chosen.begin(), chosen.end(), [&](const Rung<Dim>* other) {
          return overlap(*rung, *other) > SearchOptions::kMostOverlap;
        }))
      chosen.push_back(rung);
  }
  return chosen;
}

template <int Dim>
Region<Dim> region_of(const View<Dim>& view, const Rung<Dim>& rung) {
  std::vector<float> share(rung.inside.begin(), rung.inside.end());
  blur(rung.box, share);
  Flags filled(share.size());
  std::transform(share.begin(), share.end(), filled.begin(),
                 [](float s) { return std::uint8_t(s > 0.5f); });
  fill_holes(rung.box, filled);  // the blur has closed narrow ways into more
  for (std::size_t at = 0; at < share.size(); ++at)
    if (filled[at] && share[at] <= 0.5f) share[at] = 1;
  Vector<Dim> lower;
  for (int axis = 0; axis < Dim; ++axis) lower[axis] = rung.box.lower[axis];
  const double node_mm = view.grid.node_mm();
  Region<Dim> out{
      rung.box.size,    view.grid.node_to_world() * Eigen::Translation<double, Dim>(lower),
      std::move(share), view.seeds.front().model.mean,
      rung.half_width,  rung.neck_radius * node_mm,
      node_mm,          rung.score,
      rung.features};
  out.features.enclosed = double(rung.n_nodes) * std::pow(node_mm, Dim);
  return out;
}

}  // namespace

template <int Dim>
std::vector<Region<Dim>> search_regions(const SearchGrid<Dim>& grid,
                                        std::span<const Vector<Dim>> seeds,
                                        const SearchOptions& options,
                                        const SearchProgress& progress,
                                        const std::stop_token& stop) {
  if (seeds.empty()) return {};
  const View<Dim> view(grid, seeds);
  const std::vector<double> widths = half_widths(view.distance, view.deviation());
  auto windows = open_windows(view, widths, options, progress, stop);
  for (std::size_t n = 0; n < options.neck_radii.size(); ++n) judge(windows, n, grid.box().n());
  std::vector<Region<Dim>> regions;
  for (const Rung<Dim>* rung : choose(windows, options.max_regions))
    regions.push_back(region_of(view, *rung));
  return regions;
}

#define SURF_INSTANTIATE(Dim)                                                     \
  template std::vector<Region<Dim>> search_regions<Dim>(                          \
      const SearchGrid<Dim>&, std::span<const Vector<Dim>>, const SearchOptions&, \
      const SearchProgress&, const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
