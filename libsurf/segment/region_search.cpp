#include "libsurf/segment/region_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <thread>

#include "libsurf/segment/detail/change.h"
#include "libsurf/segment/detail/click_cut.h"
#include "libsurf/segment/object_box.h"
#include "libsurf/segment/settle_cut.h"

namespace surf::segment {
namespace {

constexpr Family kFamilies[] = {Family::kAlike, Family::kBrighter, Family::kFront};
constexpr std::size_t kMostSettled = 10;  // after 8 nothing more is found, after 22 neither
constexpr double kMostSame = 0.9;         // Dice of two that are settled
constexpr int kMargin = 6;                // nodes, for the band and what lies beyond it
constexpr int kSeedReach = 2;             // nodes from a seed to the settled region
// Depth of the seeds below that share of the greatest one counts against a region: a leak has its
// deepest place elsewhere.
constexpr double kCalmDepth = 0.75;
// Of what the border leaves to be seen. In the plane structures have 0.98 and more, and of 600
// clicks into white noise 26 find something (up to 0.77); in space structures have 0.59 and more,
// white noise 0.20 in 180 clicks (blurred 0.73).
template <int Dim>
constexpr double kLeastScore = Dim == 2 ? 0.55 : 0.5;
// separation^3 * edge_share above which a region stands out however windows grow there, if it is as
// large as a ball of this radius [nodes]: through an edge that is many nodes wide they grow evenly
// (ball of 512^3 voxels: score 0.26), and a front ends somewhere on it. Phantoms with edges of 3 to
// 12 nodes have 0.38 to 0.9, white noise 0.05, in the plane, and 0.003, in space, in 30 clicks each
// (blurred by 1 to 3 nodes 0.58 and 0.39).
constexpr double kClearBoundary = 0.36, kClearRadius = 6;
// With a box round the object.
constexpr std::size_t kMostInBox = 16;
constexpr std::array kNearness = {0.5, 1.0, 2.0, 4.0};  // of the cuts
constexpr double kCutGrowth = 0.4;                      // in place of the growth of a ladder
constexpr double kTail = 0.02;  // of the intensities of a front's region, on either side
// Of the cubes of search_outward() [nodes]. With one of 20 to 54, or with two or three of them, the
// regions of 23 structures have a mean Dice of 0.620 to 0.655, without 0.622: the smaller ones gain
// most.
constexpr std::array kHalfWidths = {24, 36};
// What a cube may hold of it to be worth its time. Where it held 0.45, five of 18 noisy tori in
// 64^3 voxels ended at a crumb of noise in it; the first clicks into 23 structures are the same
// with 0.7.
constexpr double kMostOfGrid = 0.3;
// Less may be a crumb of something larger (a hip bone ends at a piece of its marrow without; from
// 0.65 to 0.8 the mean Dice is the same).
constexpr double kLeastInCube = 0.7;

/// Tells on the caller's own thread of what is done on any.
template <int Dim>
class Teller {
 public:
  Teller(const SearchProgress<Dim>& progress, std::stop_source& stop)
      : progress_(progress), stop_(stop) {}
  void done(const Rung<Dim>* seen = nullptr) {
    ++n_done_;
    if (progress_ && std::this_thread::get_id() == caller_ && !stop_.stop_requested() &&
        !progress_(n_done_, seen))
      stop_.request_stop();
  }

 private:
  const SearchProgress<Dim>& progress_;
  std::stop_source& stop_;
  std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<int> n_done_ = 0;
};

template <int Dim>
bool is_large_enough(const Rung<Dim>& rung, double radius = kLeastObjectRadius) {
  return double(rung.n_nodes) >= nodes_of_ball<Dim>(radius);
}

/// As if it were clicked in its middle: where the seeds are ranks regions, but a skull's inside is
/// an object however near the bone it is clicked. What lies on the border of the grid can be on no
/// edge: it is the rest of the boundary that has to be.
template <int Dim>
bool stands_out(const Rung<Dim>& settled) {
  const RungFeatures& features = settled.features;
  if (is_large_enough(settled, kClearRadius) &&
      std::pow(features.separation, 3) * features.edge_share >
          kClearBoundary * (1 - settled.border_share))
    return true;
  return is_large_enough(settled) && settled_score(settled, 1) * std::exp(settled.border_share) >=
                                         kLeastScore<Dim> * (1 - settled.border_share);
}

/// Those of the ladders that are large enough.
template <int Dim>
std::vector<const Rung<Dim>*> candidates(const std::vector<Windows<Dim>>& ladders) {
  std::vector<const Rung<Dim>*> out;
  for (const Windows<Dim>& windows : ladders)
    for (std::size_t n = 0; !windows.empty() && n < windows.front().size(); ++n)
      for (const auto& window : windows)
        if (is_large_enough(window[n])) out.push_back(&window[n]);
  return out;
}

/// The box of the rung's nodes with a margin that the grid limits.
template <int Dim>
NodeBox<Dim> box_round(const NodeBox<Dim>& grid, const Rung<Dim>& rung) {
  NodeBox<Dim> out = rung.inside.bounds(0);
  for (int axis = 0; axis < Dim; ++axis) {
    const int first = std::max(0, out.lower[axis] - kMargin),
              last = std::min(grid.size[axis], out.lower[axis] + out.size[axis] + kMargin);
    out.lower[axis] = first;
    out.size[axis] = last - first;
  }
  return out;
}

/// The seeds' nodes and those round them are inside, faces beyond which the object cannot be are
/// not.
template <int Dim>
std::vector<Held> held_at_seeds(const SeedView<Dim>& view, const NodeBox<Dim>& box) {
  std::vector<Held> out(box.n(), Held::kFree);
  outside_faces(view.grid).in(box).for_each([&](std::size_t at) { out[at] = Held::kOutside; });
  NodeBox<Dim> around;
  around.lower.fill(-1);
  around.size.fill(3);
  for (const SeedNodes<Dim>& seed : view.seeds)
    for (const auto& center : seed.nodes)
      for (std::size_t n = 0; n < around.n(); ++n) {
        auto node = around.node(n);
        for (int axis = 0; axis < Dim; ++axis) node[axis] += center[axis];
        if (box.contains(node)) out[box.at(node)] = Held::kInside;
      }
  return out;
}

template <int Dim>
void weigh_by_fit(const SearchGrid<Dim>& grid, std::vector<Windows<Dim>>& ladders) {
  for (Windows<Dim>& windows : ladders)
    for (auto& window : windows)
      for (Rung<Dim>& rung : window)
        if (rung.n_nodes > 0) rung.score *= box_fit(grid, rung.inside.bounds(0));
}

/// With a box round the object: what a least cut parts from its faces.
template <int Dim>
std::vector<Rung<Dim>> cuts(const SeedView<Dim>& view) {
  std::vector<Rung<Dim>> out;
  if (!view.grid.has_outside_faces()) return out;
  const NodeSet<Dim> nothing(view.grid.box());
  ClickScene<Dim> scene{view.grid, nothing, {}, view.noise};
  for (const SeedNodes<Dim>& seed : view.seeds) scene.clicks.push_back({seed, Side::kInside});
  for (const double nearness : kNearness) {
    ClickCutOptions of_cut;
    of_cut.nearness = nearness;
    for (const NodeSet<Dim>& inside : click_cuts<Dim>(scene, std::array{0.0}, of_cut).inside) {
      Rung<Dim> rung;
      rung.family = Family::kCut;
      rung.inside = inside.in(inside.bounds(kMargin));
      rung.n_nodes = rung.inside.count();
      rung.features.growth_in = 0;
      rung.features.growth_out = kCutGrowth;
      if (is_large_enough(rung)) out.push_back(std::move(rung));
    }
  }
  return out;
}

/// The rung's region settled on the edges near its boundary, measured and scored again.
template <int Dim>
Rung<Dim> settle(const SeedView<Dim>& view, const Rung<Dim>& rung) {
  const NodeBox<Dim>& grid = view.grid.box();
  Rung<Dim> out = rung;
  const NodeBox<Dim> box = box_round(grid, rung);
  const NodeSet<Dim> all(
      box, settled(box, rung.inside.in(box).flags(), cropped(grid, view.grid.intensity(), box),
                   held_at_seeds(view, box), view.noise));
  out.inside = all.component(view.starts(all, kSeedReach)).filled();
  measure(grid, view.grid.level(), view.edge, out);
  out.kept = out.n_nodes == 0 ? 0 : overlap(out, rung);
  std::vector<typename NodeBox<Dim>::Index> nodes;
  for (const SeedNodes<Dim>& seed : view.seeds)
    nodes.insert(nodes.end(), seed.nodes.begin(), seed.nodes.end());
  const Depths depths = depths_of<Dim>(grid, out.inside, nodes);
  out.score =
      settled_score(out, depths.share(kCalmDepth)) * box_fit(view.grid, out.inside.bounds(0));
  return out;
}

/// The window's ends [intensity]; of what has none, where nearly all intensities within lie.
template <int Dim>
std::pair<double, double> intensities(const SeedView<Dim>& view, const Rung<Dim>& rung) {
  const double mean = view.seeds.front().model.mean;
  if (rung.family == Family::kAlike && rung.half_width > 0)
    return {mean - rung.half_width, mean + rung.half_width};
  std::vector<float> values;
  rung.inside.for_each_in(view.grid.box(),
                          [&](std::size_t at) { values.push_back(view.grid.intensity()[at]); });
  const auto ranked = [&](double share) {
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return double(*at);
  };
  const double low = rung.family == Family::kBrighter ? mean - rung.half_width : ranked(kTail);
  return {low, std::max(low, ranked(1 - kTail))};
}

template <int Dim>
bool is_cut_off(const SearchGrid<Dim>& grid, const Rung<Dim>& rung) {
  return grid.is_cut_off(rung.inside.bounds(0));
}

/// In a cube first what ends within it; of the rest, which often leaks and takes longest, what may
/// still be better than the best of these. (A noisy ball of 256^3 voxels: proposing 2.8 s if all
/// settle.)
template <int Dim>
std::vector<Rung<Dim>> settle_all(const SeedView<Dim>& view,
                                  const std::vector<const Rung<Dim>*>& rungs, Teller<Dim>& teller,
                                  const std::stop_source& stop) {
  std::vector<Rung<Dim>> out;
  for (const bool are_cut_off : {false, true}) {
    double best = 0;
    for (const Rung<Dim>& rung : out)
      if (!is_cut_off(view.grid, rung) && stands_out(rung)) best = std::max(best, rung.score);
    if (are_cut_off && best < kLeastInCube) break;
    std::vector<const Rung<Dim>*> now;
    for (const Rung<Dim>* rung : rungs)
      if (is_cut_off(view.grid, *rung) == are_cut_off && most_settled_score(*rung) > best)
        now.push_back(rung);
    std::vector<Rung<Dim>> settled(now.size());
    tbb::parallel_for(std::size_t(0), now.size(), [&](std::size_t n) {
      settled[n] = stop.stop_requested() ? *now[n] : settle(view, *now[n]);
      teller.done();
    });
    std::move(settled.begin(), settled.end(), std::back_inserter(out));
  }
  return out;
}

template <int Dim>
SearchedRegions<Dim> stopped() {
  SearchedRegions<Dim> out;
  out.was_stopped = true;
  return out;
}

/// Of a cube's own nodes, which count from 0, in the grid.
template <int Dim>
Rung<Dim> in_grid(const NodeBox<Dim>& grid, const NodeBox<Dim>& cube, Rung<Dim> rung) {
  auto first = rung.inside.box().lower;
  for (int axis = 0; axis < Dim; ++axis) first[axis] += cube.lower[axis];
  rung.inside = rung.inside.moved_to(first);
  rung.inside = rung.inside.in(box_round(grid, rung));
  return rung;
}

template <int Dim>
bool has_last_word(const SearchGrid<Dim>& cube, const SearchedRegions<Dim>& searched) {
  if (searched.found.empty() || searched.found.front().score < kLeastInCube) return false;
  return std::all_of(searched.settled.begin(), searched.settled.end(),
                     [&](const SettledRegion<Dim>& region) {
                       return !is_cut_off(cube, region.rung) ||
                              region.rung.score * std::exp(region.rung.border_share) <
                                  searched.found.front().score;
                     });
}

/// What ends within the cube.
template <int Dim>
SearchedRegions<Dim> whole_ones(const NodeBox<Dim>& grid, const SearchGrid<Dim>& cube,
                                const NodeBox<Dim>& box, SearchedRegions<Dim> searched) {
  std::erase_if(searched.settled,
                [&](const SettledRegion<Dim>& region) { return is_cut_off(cube, region.rung); });
  for (Rung<Dim>& rung : searched.found) rung = in_grid(grid, box, std::move(rung));
  for (SettledRegion<Dim>& region : searched.settled)
    region.rung = in_grid(grid, box, std::move(region.rung));
  return searched;
}

}  // namespace

template <int Dim>
Region<Dim> region_of(const SeedView<Dim>& view, const Rung<Dim>& rung) {
  const NodeBox<Dim>& box = rung.inside.box();
  std::vector<float> share = shares(rung.inside);
  // The blur has closed narrow ways into more; what was a cavity before stays one.
  const auto blurred = NodeSet<Dim>::where(box, [&](std::size_t at) { return share[at] > 0.5f; });
  const NodeSet<Dim> cavities = rung.inside.filled() - rung.inside;
  ((blurred.filled() - blurred) - cavities).for_each([&](std::size_t at) { share[at] = 1; });
  Vector<Dim> lower;
  for (int axis = 0; axis < Dim; ++axis) lower[axis] = box.lower[axis];
  const double node_mm = view.grid.node_mm();
  const auto [low, high] = intensities(view, rung);
  Region<Dim> out{box.size,
                  view.grid.node_to_world() * Eigen::Translation<double, Dim>(lower),
                  std::move(share),
                  rung.family,
                  view.seeds.front().model.mean,
                  low,
                  high,
                  rung.neck_radius * node_mm,
                  node_mm,
                  rung.score,
                  rung.features};
  out.features.enclosed = double(rung.n_nodes) * std::pow(node_mm, Dim);
  return out;
}

template <int Dim>
std::vector<float> shares(const NodeSet<Dim>& inside) {
  std::vector<float> out(inside.box().n(), 0);
  inside.for_each([&](std::size_t at) { out[at] = 1; });
  blur(inside.box(), out);
  return out;
}

template <int Dim>
SearchedRegions<Dim> search_rungs(const SearchGrid<Dim>& grid, std::span<const Vector<Dim>> seeds,
                                  const SearchOptions& options, const SearchProgress<Dim>& progress,
                                  const std::stop_token& outer_stop) {
  if (seeds.empty()) return {};
  const SeedView<Dim> view(grid, seeds);
  std::stop_source stop;
  const std::stop_callback forwarded(outer_stop, [&] { stop.request_stop(); });
  Teller<Dim> teller(progress, stop);
  // Where windows may go if the object cannot be on all of the grid's border.
  const NodeSet<Dim> domain = outside_faces(grid).complement();
  LadderLimits<Dim> limits;
  if (grid.has_outside_faces()) limits.domain = &domain;
  std::vector<Windows<Dim>> climbed(std::size(kFamilies));
  tbb::parallel_for(std::size_t(0), climbed.size(), [&](std::size_t l) {
    if (stop.stop_requested()) return;
    const Ladder ladder = make_ladder(view, kFamilies[l], options.neck_radii, limits);
    climbed[l] = std::move(climb<Dim>(
                               view, std::span(&ladder, 1),
                               [&](const Rung<Dim>* rung) { teller.done(rung); }, stop.get_token())
                               .front());
  });
  if (grid.has_outside_faces()) weigh_by_fit(grid, climbed);
  auto best = differing(candidates(climbed), grid.has_outside_faces() ? kMostInBox : kMostSettled,
                        kMostSame);
  const std::vector<Rung<Dim>> cut = cuts(view);
  for (const Rung<Dim>& rung : cut) best.push_back(&rung);
  std::vector<Rung<Dim>> settled = settle_all(view, best, teller, stop);
  SearchedRegions<Dim> out;
  out.was_stopped = stop.stop_requested();
  std::vector<const Rung<Dim>*> found;
  for (const Rung<Dim>& rung : settled)
    if (!is_cut_off(grid, rung) &&
        (grid.has_outside_faces() ? is_large_enough(rung) : stands_out(rung)))
      found.push_back(&rung);
  for (const Rung<Dim>* rung :
       differing(std::move(found), std::size_t(options.max_regions), SearchOptions::kMostOverlap))
    out.found.push_back(*rung);
  for (Rung<Dim>& rung : settled) {
    const double boundary = boundary_score(rung);
    if (!(boundary > 0)) continue;
    const double besides = rung.score / boundary;
    out.settled.push_back({std::move(rung), besides});
  }
  std::stable_sort(out.settled.begin(), out.settled.end(),
                   [](const auto& a, const auto& b) { return a.rung.score > b.rung.score; });
  return out;
}

template <int Dim>
SearchedRegions<Dim> search_outward(const SearchGrid<Dim>& grid, const Vector<Dim>& seed,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  const std::array seeds{seed};
  int n_done = 0;  // in all cubes so far
  if (Dim == 3 && !grid.has_outside_faces())
    for (const int half_width : kHalfWidths) {
      const NodeBox<Dim> box = cube_round<Dim>(grid, seed, half_width);
      if (double(box.n()) > kMostOfGrid * double(grid.box().n())) break;
      const int n_before = n_done;
      const SearchProgress<Dim> told = [&](int n, const Rung<Dim>* seen) {
        n_done = n_before + n;
        if (!progress) return true;
        if (!seen) return progress(n_done, nullptr);
        const Rung<Dim> here = in_grid(grid.box(), box, *seen);
        return progress(n_done, &here);
      };
      const SearchGrid<Dim> cube = grid.part(box, stop);
      if (stop.stop_requested()) return stopped<Dim>();
      SearchedRegions<Dim> searched = search_rungs<Dim>(cube, seeds, options, told, stop);
      if (searched.was_stopped) return stopped<Dim>();
      if (has_last_word(cube, searched))
        return whole_ones(grid.box(), cube, box, std::move(searched));
    }
  if (!grid.make_all(stop)) return stopped<Dim>();
  return search_rungs<Dim>(
      grid, seeds, options,
      [&](int n, const Rung<Dim>* seen) { return !progress || progress(n_done + n, seen); }, stop);
}

#define SURF_INSTANTIATE(Dim)                                                     \
  template SearchedRegions<Dim> search_outward<Dim>(                              \
      const SearchGrid<Dim>&, const Vector<Dim>&, const SearchOptions&,           \
      const SearchProgress<Dim>&, const std::stop_token&);                        \
  template Region<Dim> region_of<Dim>(const SeedView<Dim>&, const Rung<Dim>&);    \
  template std::vector<float> shares<Dim>(const NodeSet<Dim>&);                   \
  template SearchedRegions<Dim> search_rungs<Dim>(                                \
      const SearchGrid<Dim>&, std::span<const Vector<Dim>>, const SearchOptions&, \
      const SearchProgress<Dim>&, const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
