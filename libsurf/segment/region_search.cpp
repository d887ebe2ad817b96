#include "libsurf/segment/region_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <numbers>

#include "libsurf/segment/rung_features.h"
#include "libsurf/volume/distance_transform.h"

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
constexpr double kShell = 2;      // nodes, outside: what the inside is compared with
constexpr int kFewSlices = 16;
constexpr double kEdgeNoise = 3;  // an edge is that many times the noise, per voxel

using Index = std::array<int, 3>;
using Flags = std::vector<std::uint8_t>;

std::size_t product(const Index& size) { return std::size_t(size[0]) * size[1] * size[2]; }

/// A box of nodes lower <= index < lower + size; its own nodes count from 0, first index fastest.
struct Box {
  Index lower = {0, 0, 0}, size = {0, 0, 0};

  std::size_t n() const { return product(size); }
  std::size_t at(const Index& node) const {
    return (std::size_t(node[2] - lower[2]) * size[1] + node[1] - lower[1]) * size[0] + node[0] -
           lower[0];
  }
  bool contains(const Index& node) const {
    for (int axis = 0; axis < 3; ++axis)
      if (node[axis] < lower[axis] || node[axis] >= lower[axis] + size[axis]) return false;
    return true;
  }
  Index node(std::size_t at) const {
    return {lower[0] + int(at % size[0]), lower[1] + int(at / size[0] % size[1]),
            lower[2] + int(at / (std::size_t(size[0]) * size[1]))};
  }
  /// Calls visit(neighbour) for those along the axes; returns how many the box cuts off.
  template <class Visit>
  int for_neighbours(std::size_t at, const Visit& visit) const {
    const Index here = node(at);
    int n_missing = 0;
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; stride *= size[axis], ++axis) {
      here[axis] > lower[axis] ? visit(at - stride) : void(++n_missing);
      here[axis] + 1 < lower[axis] + size[axis] ? visit(at + stride) : void(++n_missing);
    }
    return n_missing;
  }
};

/// The box of the flagged nodes with a margin, within `box`.
Box bounds(const Box& box, const Flags& flags, int margin) {
  Index low = box.size, high = {-1, -1, -1};
  for (std::size_t at = 0; at < flags.size(); ++at) {
    if (!flags[at]) continue;
    const Index node = box.node(at);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], node[axis] - box.lower[axis]);
      high[axis] = std::max(high[axis], node[axis] - box.lower[axis]);
    }
  }
  Box out;
  for (int axis = 0; axis < 3; ++axis) {
    const int first = std::max(low[axis] - margin, 0),
              last = std::min(high[axis] + margin, box.size[axis] - 1);
    out.lower[axis] = box.lower[axis] + first;
    out.size[axis] = std::max(last - first + 1, 0);
  }
  return out;
}

template <class T>
std::vector<T> cropped(const Box& box, const std::vector<T>& values, const Box& part) {
  std::vector<T> out(part.n());
  for (std::size_t at = 0; at < out.size(); at += part.size[0])
    std::copy_n(values.begin() + std::ptrdiff_t(box.at(part.node(at))), part.size[0],
                out.begin() + std::ptrdiff_t(at));
  return out;
}

/// The flagged nodes that are connected with one of the starts.
Flags component(const Box& box, const Flags& flags, std::vector<std::size_t> stack) {
  Flags out(box.n(), 0);
  for (const std::size_t at : stack) out[at] = 1;
  while (!stack.empty()) {
    const std::size_t at = stack.back();
    stack.pop_back();
    box.for_neighbours(at, [&](std::size_t next) {
      if (!flags[next] || out[next]) return;
      out[next] = 1;
      stack.push_back(next);
    });
  }
  return out;
}

/// The flagged node nearest to each seed, within reach; the first of equally near ones.
std::vector<std::size_t> starts(const Box& box, const Flags& flags, std::span<const Index> seeds,
                                int reach) {
  std::vector<std::size_t> out;
  for (const Index& seed : seeds) {
    int nearest = reach * reach + 1;
    std::size_t start = 0;
    for (int k = -reach; k <= reach; ++k)
      for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i) {
          const int d = i * i + j * j + k * k;
          const Index node = {seed[0] + i, seed[1] + j, seed[2] + k};
          if (d >= nearest || !box.contains(node) || !flags[box.at(node)]) continue;
          nearest = d;
          start = box.at(node);
        }
    if (nearest <= reach * reach) out.push_back(start);
  }
  return out;
}

/// Flags what the flagged nodes enclose too: all that has no way to the border of the box.
void fill_holes(const Box& box, Flags& flags) {
  Flags open(box.n());
  std::vector<std::size_t> at_border;
  for (std::size_t at = 0; at < box.n(); ++at) {
    open[at] = !flags[at];
    if (open[at] && box.for_neighbours(at, [](std::size_t) {}) > 0) at_border.push_back(at);
  }
  open = component(box, open, std::move(at_border));
  std::transform(open.begin(), open.end(), flags.begin(),
                 [](std::uint8_t is_open) { return std::uint8_t(!is_open); });
}

/// What the image shows at the nodes.
struct Scan {
  Box box;
  Eigen::Affine3d node_to_world;
  double node_mm;
  std::vector<float> intensity;
  Flags edge;  ///< |grad I| is above the noise and largest along its own direction

  Scan(const Field<3>& I, const ImageExtent<3>& extent, double noise, double max_nodes) {
    const Eigen::Vector3d spacing = extent.index_to_world.linear().colwise().norm().transpose();
    double content = 1;
    for (int axis = 0; axis < 3; ++axis) content *= spacing[axis] * extent.size[axis];
    node_mm = std::max(extent.cell_mm(), std::cbrt(content / max_nodes));
    Eigen::Vector3d step;  // voxels, so that the last node is the last voxel
    for (int axis = 0; axis < 3; ++axis) {
      const int n_steps =
          std::max(1, int(std::ceil((extent.size[axis] - 1) * spacing[axis] / node_mm - 1e-6)));
      step[axis] = double(extent.size[axis] - 1) / n_steps;
      box.size[axis] = n_steps + 1;
    }
    node_to_world = extent.index_to_world * Eigen::Scaling(step);
    intensity.resize(box.n());
    std::vector<float> slope(box.n());
    std::vector<Eigen::Vector3f> direction(box.n());  // one node far, in nodes
    const Eigen::Matrix3d to_nodes = node_mm * node_to_world.linear().inverse();
    const std::size_t slice = std::size_t(box.size[0]) * box.size[1];
    tbb::parallel_for(0, box.size[2], [&](int k) {
      Points<3> x(Eigen::Index(slice), 3);
      for (std::size_t m = 0; m < slice; ++m) {
        const Index node = box.node(k * slice + m);
        x.row(Eigen::Index(m)) =
            (node_to_world * Eigen::Vector3d(node[0], node[1], node[2])).transpose();
      }
      Samples<3> samples;
      I.sample(x, Derivatives::kFirst, samples);
      for (std::size_t m = 0; m < slice; ++m) {
        const Eigen::Vector3d gradient = samples.gradient.row(Eigen::Index(m)).transpose();
        intensity[k * slice + m] = static_cast<float>(samples.value[Eigen::Index(m)]);
        slope[k * slice + m] = static_cast<float>(gradient.norm());
        direction[k * slice + m] = (to_nodes * gradient.normalized()).cast<float>();
      }
    });
    find_edges(slope, direction, kEdgeNoise * noise / extent.cell_mm());
  }

 private:
  /// Nodes inside the box where the slope is no less one node up and down its direction.
  void find_edges(const std::vector<float>& slope, const std::vector<Eigen::Vector3f>& direction,
                  double least) {
    edge.assign(box.n(), 0);
    const auto between = [&](const Eigen::Vector3d& x) {
      Index first;
      Eigen::Vector3d t;
      for (int axis = 0; axis < 3; ++axis) {
        first[axis] = std::clamp(int(x[axis]), 0, box.size[axis] - 2);
        t[axis] = std::clamp(x[axis] - first[axis], 0.0, 1.0);
      }
      double out = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Index bit = {corner & 1, corner >> 1 & 1, corner >> 2 & 1};
        double weight = 1;
        for (int axis = 0; axis < 3; ++axis) weight *= bit[axis] ? t[axis] : 1 - t[axis];
        out += weight * slope[box.at({first[0] + bit[0], first[1] + bit[1], first[2] + bit[2]})];
      }
      return out;
    };
    Index margin;  // the gradient at the border is the spline's own
    for (int axis = 0; axis < 3; ++axis) margin[axis] = box.size[axis] < kFewSlices ? 0 : 1;
    tbb::parallel_for(margin[2], box.size[2] - margin[2], [&](int k) {
      for (int j = margin[1]; j < box.size[1] - margin[1]; ++j)
        for (int i = margin[0]; i < box.size[0] - margin[0]; ++i) {
          const std::size_t at = box.at({i, j, k});
          if (!(slope[at] > least)) continue;
          const Eigen::Vector3d here(i, j, k), up = direction[at].cast<double>();
          edge[at] = slope[at] >= between(here + up) && slope[at] >= between(here - up);
        }
    });
  }
};

/// A window's opening: its nodes, and what they look like.
struct Rung {
  double half_width = 0, neck_radius = 0;  ///< [intensity], [nodes]
  Box box;                                 ///< leaves a margin, but at the border of the grid
  std::vector<bool> inside;
  std::size_t n_nodes = 0;
  RungFeatures features;
  double border_share = 0;  ///< of the area
  double score = 0;
};

/// Ball of equal volume: 36^(1/3) pi^(1/3) V^(2/3) over the area. A node's face counts 2/3: that is
/// what a grid makes of a smooth surface, averaged over directions.
double sphericity(double n_nodes, double n_faces) {
  return std::cbrt(36 * std::numbers::pi) * std::pow(n_nodes, 2.0 / 3) / (2 * n_faces / 3);
}

/// Fills in what the boundary of the nodes inside looks like.
/// @param intensity, edge  at the nodes of the box
void measure(const Box& box, const Flags& inside, const std::vector<float>& intensity,
             const Flags& edge, Rung& rung) {
  const std::vector<float> distance = volume::squared_distances(box.size, inside);
  std::vector<float> object, shell;
  double n_faces = 0, n_on_edge = 0, n_on_border = 0;
  for (std::size_t at = 0; at < box.n(); ++at) {
    if (!inside[at]) {
      if (distance[at] <= kShell * kShell) shell.push_back(intensity[at]);
      continue;
    }
    object.push_back(intensity[at]);
    n_on_border += box.for_neighbours(at, [&](std::size_t next) {
      if (inside[next]) return;
      ++n_faces;
      n_on_edge += edge[at] || edge[next];
    });
  }
  n_faces += n_on_border;
  rung.n_nodes = object.size();
  rung.border_share = n_on_border / n_faces;
  rung.features.separation = histogram_separation(object, shell);
  rung.features.edge_share = n_on_edge / n_faces;
  rung.features.sphericity = sphericity(double(object.size()), n_faces);
}

/// As of a rung (RungFeatures::score), but what the scan cuts off is less likely to be meant, of
/// two that are equal the larger one is, and the separation counts for more. The exponents lie in
/// the middle of those that find most of 32 structures in 13 scans.
double score(const Rung& rung) {
  return rung.features.score() * std::pow(rung.features.separation, 0.3) *
         std::pow(double(rung.n_nodes), 0.03) * std::exp(-rung.border_share);
}

/// Squared distances to the outside, and to the border of the grid, beyond which nobody knows: a
/// neck that the border cuts in half is no thicker than what is left of it. But along an axis of
/// few slices all would be near the border.
std::vector<float> depths(const Box& grid, const Box& box, const Flags& outside) {
  std::vector<float> out = volume::squared_distances(box.size, outside);
  for (std::size_t at = 0; at < out.size(); ++at) {
    const Index node = box.node(at);
    for (int axis = 0; axis < 3; ++axis) {
      if (grid.size[axis] < kFewSlices) continue;
      const int to_border = std::min(node[axis] + 1, grid.size[axis] - node[axis]);
      out[at] = std::min(out[at], float(to_border * to_border));
    }
  }
  return out;
}

/// The openings of one window, one for each neck radius; those that are nowhere have no node.
/// @param distance  of the intensity at each node from the nearest of the seeds' means
std::vector<Rung> open_window(const Scan& scan, const std::vector<float>& distance,
                              double half_width, std::span<const Index> seeds,
                              std::span<const double> neck_radii) {
  std::vector<Rung> rungs(neck_radii.size());
  Flags window(scan.box.n());
  std::transform(distance.begin(), distance.end(), window.begin(),
                 [&](float d) { return std::uint8_t(d <= half_width); });
  const auto window_starts = starts(scan.box, window, seeds, kWindowReach);
  if (window_starts.empty()) return rungs;
  window = component(scan.box, window, window_starts);
  const Box box = bounds(scan.box, window, int(std::ceil(kShell)) + 1);
  window = cropped(scan.box, window, box);
  const std::vector<float> intensity = cropped(scan.box, scan.intensity, box);
  const Flags edge = cropped(scan.box, scan.edge, box);
  Flags outside(box.n());
  std::transform(window.begin(), window.end(), outside.begin(),
                 [](std::uint8_t flag) { return std::uint8_t(!flag); });
  const std::vector<float> depth = depths(scan.box, box, outside);
  for (std::size_t n = 0; n < rungs.size(); ++n) {
    const double r = neck_radii[n];
    Flags core(box.n());
    std::transform(depth.begin(), depth.end(), core.begin(),
                   [&](float d) { return std::uint8_t(d > r * r); });
    const auto core_starts = starts(box, core, seeds, kOpeningReach);
    if (core_starts.empty()) continue;
    core = component(box, core, core_starts);
    const std::vector<float> to_core = volume::squared_distances(box.size, core);
    Flags inside(box.n());
    for (std::size_t at = 0; at < box.n(); ++at) inside[at] = window[at] && to_core[at] <= r * r;
    fill_holes(box, inside);
    Rung& rung = rungs[n];
    rung.half_width = half_width;
    rung.neck_radius = r;
    rung.box = box;
    rung.inside.assign(inside.begin(), inside.end());
    measure(box, inside, intensity, edge, rung);
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

/// Scores each rung of one neck radius, by its growth in number of nodes too.
void judge(std::vector<std::vector<Rung>>& windows, std::size_t radius, std::size_t n_grid) {
  for (std::size_t w = 0; w < windows.size(); ++w) {
    Rung& rung = windows[w][radius];
    if (rung.n_nodes == 0) continue;
    const auto ratio = [&](std::size_t larger, std::size_t smaller) {
      return std::max(0.0, std::log(double(larger) / double(smaller)));
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
double overlap(const Rung& a, const Rung& b) {
  const double most = 2 * double(std::min(a.n_nodes, b.n_nodes)) / double(a.n_nodes + b.n_nodes);
  if (most <= RegionSearchOptions::kMostOverlap) return most;
  std::size_t n_both = 0;
  for (std::size_t at = 0; at < a.inside.size(); ++at) {
    if (!a.inside[at]) continue;
    const Index node = a.box.node(at);
    n_both += b.box.contains(node) && b.inside[b.box.at(node)];
  }
  return 2 * double(n_both) / double(a.n_nodes + b.n_nodes);
}

/// Blurred along each axis by a binomial filter of deviation 1; beyond the box as at its border.
void blur(const Index& size, std::vector<float>& values) {
  constexpr std::array<float, 5> kBinomial = {1.f / 16, 4.f / 16, 6.f / 16, 4.f / 16, 1.f / 16};
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; stride *= size[axis], ++axis) {
    const std::vector<float> before = values;
    for (std::size_t at = 0; at < values.size(); ++at) {
      const int here = int(at / stride % size[axis]);
      float sum = 0;
      for (int s = -2; s <= 2; ++s) {
        const int there = std::clamp(here + s, 0, size[axis] - 1);
        sum += kBinomial[s + 2] *
               before[std::size_t(std::ptrdiff_t(at) + (there - here) * std::ptrdiff_t(stride))];
      }
      values[at] = sum;
    }
  }
}

Region region_of(const Scan& scan, const Rung& rung) {
  std::vector<float> share(rung.inside.begin(), rung.inside.end());
  blur(rung.box.size, share);
  Flags filled(share.size());
  std::transform(share.begin(), share.end(), filled.begin(),
                 [](float s) { return std::uint8_t(s > 0.5f); });
  fill_holes(rung.box, filled);  // the blur has closed narrow ways into more
  for (std::size_t at = 0; at < share.size(); ++at)
    if (filled[at] && share[at] <= 0.5f) share[at] = 1;
  const auto& lower = rung.box.lower;
  const Eigen::Affine3d to_world =
      scan.node_to_world * Eigen::Translation3d(lower[0], lower[1], lower[2]);
  return {volume::Volume(rung.box.size, to_world, share), rung.half_width,
          rung.neck_radius * scan.node_mm, rung.score};
}

}  // namespace

std::vector<Region> search_regions(const Field<3>& I, const ImageExtent<3>& extent,
                                   std::span<const SeedModel> models,
                                   std::span<const Vector<3>> seeds,
                                   const RegionSearchOptions& options,
                                   const std::function<bool(int n_done)>& progress) {
  double noise = 0, deviation = std::numeric_limits<double>::infinity();
  for (const SeedModel& model : models) {
    noise = std::max(noise, model.noise);
    deviation = std::min(deviation, model.deviation);
  }
  const Scan scan(I, extent, noise, options.max_nodes);
  std::vector<float> distance(scan.intensity.size(), std::numeric_limits<float>::infinity());
  for (const SeedModel& model : models)
    for (std::size_t at = 0; at < distance.size(); ++at)
      distance[at] = std::min(distance[at], std::abs(scan.intensity[at] - float(model.mean)));
  std::vector<Index> seed_nodes;
  for (const Vector<3>& point : seeds) {
    const Eigen::Vector3d node = scan.node_to_world.inverse() * point;
    Index& out = seed_nodes.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      out[axis] = std::clamp(int(std::lround(node[axis])), 0, scan.box.size[axis] - 1);
  }
  const std::vector<double> widths = half_widths(distance, deviation);
  const std::size_t n_radii = options.neck_radii.size();
  std::vector<std::vector<Rung>> windows(widths.size(), std::vector<Rung>(n_radii));
  std::atomic<bool> is_stopped = false;
  std::mutex mutex;
  int n_done = 0;
  tbb::parallel_for(std::size_t(0), widths.size(), [&](std::size_t w) {
    if (is_stopped) return;
    windows[w] = open_window(scan, distance, widths[w], seed_nodes, options.neck_radii);
    const std::lock_guard lock(mutex);
    if (!is_stopped && !progress(++n_done)) is_stopped = true;
  });
  const double least_nodes = 4 * std::numbers::pi / 3 * std::pow(kLeastRadius, 3);
  std::vector<const Rung*> best;
  for (std::size_t n = 0; n < n_radii; ++n) {
    judge(windows, n, scan.box.n());
    for (const auto& window : windows)
      if (double(window[n].n_nodes) >= least_nodes) best.push_back(&window[n]);
  }
  std::stable_sort(best.begin(), best.end(),
                   [](const Rung* a, const Rung* b) { return a->score > b->score; });
  std::vector<const Rung*> chosen;
  for (const Rung* rung : best) {
    if (int(chosen.size()) == options.max_regions) break;
    if (std::none_of(chosen.begin(), chosen.end(), [&](const Rung* other) {
          return overlap(*rung, *other) > RegionSearchOptions::kMostOverlap;
        }))
      chosen.push_back(rung);
  }
  std::vector<Region> regions;
  for (const Rung* rung : chosen) regions.push_back(region_of(scan, *rung));
  return regions;
}

}  // namespace surf::segment
