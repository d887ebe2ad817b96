#include "libsurf/segment/correction.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "libsurf/segment/detail/change.h"
#include "libsurf/segment/detail/click_cut.h"
#include "libsurf/segment/detail/majority.h"
#include "libsurf/segment/object_box.h"
#include "libsurf/segment/settle_cut.h"

namespace surf::segment {
namespace {

constexpr std::size_t kLeastObject = 50;  // nodes
constexpr std::size_t kMostPieces = 10, kMostWhole = 8;
constexpr double kMostSame = 0.9;  // Dice of two changes
constexpr double kClosed = 5;      // nodes from an addition: farther off nothing is closed
constexpr double kFree = 3.5;      // nodes from the change: what may settle
constexpr int kSettleMargin = 14;  // nodes, for the means
constexpr double kWhole = 1.25;
// In place of the growth of a ladder: the more clicks there are, the more a cut between them knows.
// With a box round the object it knows more from the beginning (23 structures, mean Dice after 4
// and 5 clicks 0.878 and 0.884 in place of 0.860 and 0.865).
struct CutGrowth {
  double first, per_click, most;
  double operator()(std::size_t n_clicks) const {
    return std::min(most, first + per_click * double(n_clicks));
  }
};
constexpr CutGrowth kCutGrowth{0.35, 0.15, 1.4}, kCutGrowthInBox{0.6, 0.2, 1.7};
constexpr std::array kObjectWeights = {0.0, 0.5};
// Times what a node costs in a cut between clicks, where that settles: what the clicks have shown
// is not given up for a stronger edge beyond it (a spleen leaked to the outside of the chest's wall
// again). Each cut settles without it, too: a layer that nobody has
// clicked, as a bone's cortex round its marrow, is found by its edges alone.
constexpr double kShown = 2;
constexpr double kLeastDepth = 0.55, kDepth = 2;
// Before it settles: 23 structures end at the same regions after each of nine clicks without it.
constexpr double kLeastDepthOfPiece = 0.3;
constexpr double kShare = 0.5, kFirstDepth = 0.3, kCalmDepth = 0.75, kSize = 1.05,
                 kAgreement = 0.25;
// The larger addition is meant as long as much is missing; from this click on that counts less,
// as 1 / n of them: the seventh click in a spleen joined as much of the chest's wall as it had.
constexpr double kEarlyClicks = 3;
// What changes less than a share of the object is seldom meant, and who has clicked before has not
// clicked at the boundary: depths of the earlier clicks, up to 4 nodes, by which they have become
// shallower. 21 structures, mean Dice of the regions after 3, 4, 5 and 6 clicks without both 0.832,
// 0.854, 0.868, 0.881, ten clicks that lose more than 0.005, one of them 0.08; with the depths
// 0.832, 0.861, 0.869, 0.884, six, none above 0.05; with both 0.833, 0.861, 0.876, 0.884, ten.
constexpr double kLeastChange = 0.02, kSmallChange = 0.3, kSteady = 0.5;
constexpr int kDeepEnough = 4;
constexpr double kLeastGrowth = 0.1;
// Candidates that mean the same end a node or two beside each other, and what most of them have is
// right more often than what one has: 250 corrections of 23 structures, by the deepest clicks and
// by drawn ones, mean Dice 0.832 in place of 0.829 (chosen without the person 0.832), 9.6 % lose
// more than 0.005 and 2.4 % more than 0.05 in place of 12.4 % and 4.0 %. Where all candidates vote
// 0.834, but a hip bone ends at a fifth of itself.
constexpr double kMeansTheSame = 0.7;  // Dice with the best one
constexpr double kVote = 2;

/// A candidate in the box of the scene.
template <int Dim>
struct Candidate {
  NodeSet<Dim> after;
  Family family = Family::kBall;
  bool is_whole = false;
  bool is_as_shown = false;  // settles by what clicks have shown as well
  double growth = 1;
  double score = 0;  // without the agreement
  NodeSet<Dim> change = {};
  double kept = 1;

  Candidate(NodeSet<Dim> object, Family from, bool whole, double of_growth)
      : after(std::move(object)), family(from), is_whole(whole), growth(of_growth) {}
};

/// 0 if there is nothing in either.
template <int Dim>
double dice(const NodeSet<Dim>& a, const NodeSet<Dim>& b) {
  return 2 * double(a.count_in_both(b)) / std::max(1.0, double(a.count() + b.count()));
}

double growth_of(const RungFeatures& f) {
  return std::max(f.growth_out, kLeastGrowth) * std::exp(-f.growth_in / 4);
}

template <int Dim>
class Corrector {
  using Index = typename NodeBox<Dim>::Index;

 public:
  Corrector(const ClickScene<Dim>& scene, std::span<const SettledRegion<Dim>> first,
            const typename NodeBox<Dim>::Index& lower, const std::stop_token& stop)
      : scene_(scene),
        box_(scene.box()),
        side_(scene.click().side),
        first_(first),
        lower_(lower),
        stop_(stop),
        held_(scene.held()),
        loose_(scene.before - clicked(scene.before)),
        edge_(SeedView<Dim>(scene.grid, {scene.click().seed}, scene.noise).edge) {}

  std::vector<Candidate<Dim>> all() {
    std::vector<Candidate<Dim>> out, by_cut;
    tbb::parallel_invoke([&] { out = with_pieces(); }, [&] { by_cut = cuts(); });
    for (Candidate<Dim>& cut : by_cut) out.push_back(std::move(cut));
    for (Candidate<Dim>& whole : wholes()) out.push_back(std::move(whole));
    tbb::parallel_for(std::size_t(0), out.size(), [&](std::size_t c) {
      if (stop_.stop_requested()) return;
      if (!out[c].is_whole) settle(out[c]);
      score(out[c]);
    });
    std::erase_if(out, [](const auto& c) { return !(c.score > 0); });
    agree(out);
    std::stable_sort(out.begin(), out.end(),
                     [](const auto& a, const auto& b) { return a.score > b.score; });
    if (out.empty()) {
      out.emplace_back(scene_.before, Family::kBall, false, 1);
    }
    out.front().after = vote(out);
    for (Candidate<Dim>& candidate : out) obey(candidate.after);
    return out;
  }

 private:
  bool adds() const { return side_ == Side::kInside; }

  /// The best pieces that differ, with the object.
  std::vector<Candidate<Dim>> with_pieces() const {
    std::vector<Rung<Dim>> found = pieces(scene_, stop_);
    tbb::parallel_for(std::size_t(0), found.size(), [&](std::size_t n) {
      Rung<Dim>& rung = found[n];
      const ChangeFeatures change =
          measure_change(box_, rung.inside, scene_.before, side_, scene_.grid.level(), edge_);
      rung.score = change.score(side_) * growth_of(rung.features);
    });
    std::vector<Candidate<Dim>> out;
    for (const Rung<Dim>* rung : best_by_depth(found)) {
      Candidate<Dim> candidate(scene_.before, rung->family, false, growth_of(rung->features));
      const NodeSet<Dim> piece = rung->inside.in(box_);
      adds() ? candidate.after |= piece : candidate.after -= piece;
      if (candidate.after.count() >= kLeastObject) out.push_back(std::move(candidate));
    }
    return out;
  }

  /// The best that differ. Depths cost most, so they are taken of those alone that may be among
  /// them: a score without its depth is the most that it can be.
  std::vector<const Rung<Dim>*> best_by_depth(std::vector<Rung<Dim>>& found) const {
    std::vector<Rung<Dim>*> order;
    for (Rung<Dim>& rung : found) order.push_back(&rung);
    std::stable_sort(order.begin(), order.end(),
                     [](const auto* a, const auto* b) { return a->score > b->score; });
    std::vector<const Rung<Dim>*> best;
    for (std::size_t n_known = 0; n_known < order.size();) {
      const std::size_t end = std::min(n_known + kMostPieces, order.size());
      tbb::parallel_for(n_known, end, [&](std::size_t n) {
        Rung<Dim>& rung = *order[n];
        const NodeSet<Dim> part = rung.inside.component(starts_in(rung.inside));
        rung.score *=
            std::pow(depth_share(part) * double(part.count()) / double(rung.n_nodes), kDepth);
      });
      n_known = end;
      std::vector<const Rung<Dim>*> known(order.begin(), order.begin() + std::ptrdiff_t(n_known));
      std::sort(known.begin(), known.end());  // of equals that which was found first
      best = differing(std::move(known), kMostPieces, kMostSame);
      if (best.size() == kMostPieces && n_known < order.size() &&
          order[n_known]->score < best.back()->score)
        break;
    }
    return best;
  }

  /// 0 where it is too little for the change that will come of it.
  double depth_share(const NodeSet<Dim>& part) const {
    const auto& nodes = scene_.click().seed.nodes;
    if (most_share<Dim>(part, nodes) < kLeastDepthOfPiece) return 0;
    const double share = depths_of<Dim>(box_, part, nodes).share();
    return share < kLeastDepthOfPiece ? 0 : share;
  }

  /// Cuts between all clicks, one of them near the object; each twice, as it settles. And what of
  /// each changes at the click, to its side: elsewhere and the other way nobody has asked for it.
  std::vector<Candidate<Dim>> cuts() {
    const double growth =
        (scene_.grid.has_outside_faces() ? kCutGrowthInBox : kCutGrowth)(scene_.clicks.size());
    ClickCuts<Dim> found = click_cuts(scene_, kObjectWeights);
    for (float& cost : found.costs) cost *= float(kShown);
    shown_ = std::move(found.costs);
    std::vector<Candidate<Dim>> out;
    for (NodeSet<Dim>& after : found.inside) {
      if (NodeSet<Dim> part = part_at_click(after); part.count() >= kLeastObject) {
        out.emplace_back(std::move(part), Family::kCut, false, growth);
        out.back().is_as_shown = true;
      }
      out.emplace_back(after, Family::kCut, false, growth);
      out.back().is_as_shown = true;
      out.emplace_back(std::move(after), Family::kCut, false, growth);
    }
    return out;
  }

  /// The object with what `after` adds, or without what it takes away, where that holds the click;
  /// nothing if it does not.
  NodeSet<Dim> part_at_click(const NodeSet<Dim>& after) const {
    const NodeSet<Dim> changed = adds() ? after - scene_.before : scene_.before - after;
    NodeSet<Dim> piece = changed.component(starts_in(changed)).in(box_);
    if (piece.is_empty()) return piece;
    return adds() ? scene_.before | piece : scene_.before - piece;
  }

  /// Regions of the first click that have all clicks where they belong and lie in the box.
  std::vector<Candidate<Dim>> wholes() const {
    std::vector<Candidate<Dim>> out;
    for (const SettledRegion<Dim>& region : first_) {
      if (out.size() == kMostWhole) break;
      NodeBox<Dim> here = box_;
      here.lower = lower_;
      Candidate<Dim> candidate(region.rung.inside.in(here).moved_to(box_.lower), region.rung.family,
                               true, kWhole * region.besides);
      bool fits = candidate.after.count() == region.rung.n_nodes;
      for (const GridClick<Dim>& click : scene_.clicks)
        for (const auto& node : click.seed.nodes)
          fits = fits && candidate.after.contains(node) == (click.side == Side::kInside);
      if (fits) out.push_back(std::move(candidate));
    }
    return out;
  }

  /// Only near what has changed.
  void settle(Candidate<Dim>& candidate) const {
    NodeSet<Dim>& after = candidate.after;
    const NodeSet<Dim> unsettled = after ^ scene_.before;
    if (adds()) after = (after | (after.closed() & unsettled.dilated(kClosed))).filled();
    const NodeSet<Dim> change = after ^ scene_.before;
    const NodeBox<Dim> part = change.bounds(kSettleMargin);
    if (part.n() == 0) return;
    const NodeSet<Dim> inside = after.in(part), fixed = change.in(part).dilated(kFree).complement();
    const Flags is_inside = inside.flags();
    std::vector<Held> held = cropped(box_, held_, part);
    fixed.for_each([&](std::size_t at) {
      if (held[at] == Held::kFree) held[at] = is_inside[at] ? Held::kInside : Held::kOutside;
    });
    const bool has_costs = candidate.is_as_shown && !shown_.empty();
    const NodeSet<Dim> settled_part(
        part,
        settled(part, is_inside, cropped(box_, scene_.grid.intensity(), part), held, scene_.noise,
                has_costs ? cropped(box_, shown_, part) : std::vector<float>()));
    after ^= (inside ^ settled_part).in(box_);
    keep_clicked(after);
    candidate.kept = dice(unsettled, after ^ scene_.before);
  }

  /// Only what is connected with an inside click; all if none is in it.
  NodeSet<Dim> clicked(const NodeSet<Dim>& nodes) const {
    std::vector<Index> starts;
    for (const GridClick<Dim>& click : scene_.clicks)
      if (click.side == Side::kInside)
        for (const auto& node : click.seed.nodes)
          if (nodes.contains(node)) starts.push_back(node);
    return starts.empty() ? nodes : nodes.component(starts);
  }

  /// And what was connected with none before: an evolved shape may be thinner than a node.
  void keep_clicked(NodeSet<Dim>& after) const { after = clicked(after) | (loose_ & after); }

  std::vector<Index> starts_in(const NodeSet<Dim>& nodes) const {
    std::vector<Index> out;
    for (const Index& node : scene_.click().seed.nodes)
      if (nodes.contains(node)) out.push_back(node);
    return out;
  }

  void score(Candidate<Dim>& candidate) const {
    const NodeSet<Dim>& after = candidate.after;
    candidate.change = after ^ scene_.before;
    // To the click's side, and what settling has given back.
    const NodeSet<Dim> changed = adds() ? candidate.change & after : candidate.change - after,
                       back = candidate.change - changed;
    NodeSet<Dim> piece = changed.component(starts_in(changed));
    piece = piece.in(piece.bounds(3));
    if (piece.is_empty() || (adds() && is_held_alone(piece))) return;
    const Depths depths = depths_of<Dim>(box_, piece, scene_.click().seed.nodes);
    if (depths.share() < kLeastDepth) return;
    const ChangeFeatures change =
        measure_change(box_, piece, scene_.before, side_, scene_.grid.level(), edge_);
    Rung<Dim> whole;
    whole.inside = after.in(after.bounds(3));
    measure(box_, scene_.grid.level(), edge_, whole);
    if (whole.n_nodes == 0) return;
    const auto largest = double(std::max(largest_component(changed), largest_component(back)));
    candidate.score =
        std::sqrt(std::max(change.score(side_), 1e-6) * std::max(boundary_score(whole), 1e-6)) *
        std::pow(depths.share(), kDepth) * std::pow(change.n_nodes / largest, kShare) *
        std::pow(depths_of<Dim>(box_, whole.inside, first_nodes()).share(kCalmDepth), kFirstDepth) *
        candidate.growth * size_factor(whole.n_nodes) *
        (double(changed.count()) / double(candidate.change.count())) *
        std::pow(share_of_least_change(candidate), kSmallChange) *
        std::pow(steadiness(after), kSteady) * box_fit(scene_.grid, after.bounds(0));
  }

  /// All that is left of an addition that has not settled, and hangs on nothing.
  bool is_held_alone(const NodeSet<Dim>& piece) const {
    bool out = piece.dilated(1).count_in_both(scene_.before.in(piece.box())) == 0;
    piece.for_each(
        [&](std::size_t at) { out = out && held_[box_.at(piece.box().node(at))] != Held::kFree; });
    return out;
  }

  double size_factor(std::size_t n_nodes) const {
    const double before = std::max(1.0, double(scene_.before.count()));
    const double early = adds() ? std::min(1.0, kEarlyClicks / double(scene_.clicks.size())) : 1.0;
    return std::pow(before * std::pow(double(n_nodes) / before, early), kSize / Dim);
  }

  /// Distance from a click to the nearest node of the other side [nodes], up to kDeepEnough.
  double depth_at(const NodeSet<Dim>& inside, const GridClick<Dim>& click) const {
    double deepest = 0;
    for (const Index& center : click.seed.nodes) {
      NodeBox<Dim> around;
      int most = kDeepEnough * kDeepEnough;
      for (int axis = 0; axis < Dim; ++axis) {
        around.lower[axis] = center[axis] - kDeepEnough;
        around.size[axis] = 2 * kDeepEnough + 1;
      }
      for (std::size_t n = 0; n < around.n(); ++n) {
        const Index node = around.node(n);
        int squared = 0;
        for (int axis = 0; axis < Dim; ++axis)
          squared += (node[axis] - center[axis]) * (node[axis] - center[axis]);
        if (squared < most && box_.contains(node) &&
            inside.contains(node) != (click.side == Side::kInside))
          most = squared;
      }
      deepest = std::max(deepest, std::sqrt(double(most)));
    }
    return deepest;
  }

  /// How much of their depth the earlier clicks keep, the worst of them.
  double steadiness(const NodeSet<Dim>& after) const {
    double least = 1;
    for (const GridClick<Dim>& click : std::span(scene_.clicks).first(scene_.clicks.size() - 1))
      least =
          std::min(least, (depth_at(after, click) + 0.5) / (depth_at(scene_.before, click) + 0.5));
    return least;
  }

  double share_of_least_change(const Candidate<Dim>& candidate) const {
    return std::min(1.0, double(candidate.change.count()) /
                             (kLeastChange * std::max(1.0, double(scene_.before.count()))));
  }

  const std::vector<typename NodeBox<Dim>::Index>& first_nodes() const {
    for (const GridClick<Dim>& click : scene_.clicks)
      if (click.side == Side::kInside) return click.seed.nodes;
    return scene_.click().seed.nodes;
  }

  static void agree(std::vector<Candidate<Dim>>& candidates) {
    const std::size_t n = candidates.size();
    if (n < 2) return;
    std::vector<double> sums(n, 0);
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = a + 1; b < n; ++b) {
        const double same = dice(candidates[a].change, candidates[b].change);
        sums[a] += same;
        sums[b] += same;
      }
    for (std::size_t c = 0; c < n; ++c)
      candidates[c].score *= std::pow(std::max(sums[c] / double(n - 1), 0.01), kAgreement);
  }

  /// What most of those have inside that mean the same as the best one, by their scores.
  NodeSet<Dim> vote(const std::vector<Candidate<Dim>>& best_first) const {
    const Candidate<Dim>& best = best_first.front();
    if (best_first.size() == 1) return best.after;
    std::vector<const NodeSet<Dim>*> same;
    std::vector<double> weights;
    for (const Candidate<Dim>& candidate : best_first) {
      if (dice(candidate.after, best.after) < kMeansTheSame) continue;
      same.push_back(&candidate.after);
      weights.push_back(std::pow(candidate.score / best.score, kVote));
    }
    NodeSet<Dim> out = majority<Dim>(same, weights);
    keep_clicked(out);
    return out;
  }

  void obey(NodeSet<Dim>& after) const {
    const auto is_held = [&](std::size_t at) {
      return (held_[at] == Held::kInside) == after.contains(box_.node(at));
    };
    for (const GridClick<Dim>& click : scene_.clicks)
      for (const auto& node : click.seed.nodes) {
        if (is_held(box_.at(node))) continue;
        NodeBox<Dim> around;
        for (int axis = 0; axis < Dim; ++axis) around.lower[axis] = node[axis] - 1;
        around.size.fill(3);
        for (std::size_t n = 0; n < around.n(); ++n)
          if (const auto near = around.node(n); box_.contains(near))
            if (const std::size_t at = box_.at(near); held_[at] != Held::kFree)
              held_[at] == Held::kInside ? after.insert(near) : after.erase(near);
      }
  }

  const ClickScene<Dim>& scene_;
  const NodeBox<Dim>& box_;
  Side side_;
  std::span<const SettledRegion<Dim>> first_;
  typename NodeBox<Dim>::Index lower_;
  const std::stop_token& stop_;
  std::vector<Held> held_;
  NodeSet<Dim> loose_;  // of the object, connected with no inside click
  NodeSet<Dim> edge_;
  std::vector<float> shown_;  // costs of nodes, by what clicks have shown
};

}  // namespace

template <int Dim>
std::vector<Correction<Dim>> corrections(const SearchGrid<Dim>& grid, const NodeSet<Dim>& before,
                                         std::span<const GridClick<Dim>> clicks,
                                         std::span<const SettledRegion<Dim>> first, double noise,
                                         const std::stop_token& stop) {
  const NodeBox<Dim> box = surroundings(grid, before, clicks);
  const SearchGrid<Dim> part = grid.part(box, stop);
  // Its own nodes count from 0.
  const NodeSet<Dim> object = before.in(box).moved_to(part.box().lower);
  ClickScene<Dim> scene{part, object, {clicks.begin(), clicks.end()}, noise};
  for (GridClick<Dim>& click : scene.clicks)
    for (auto& node : click.seed.nodes)
      for (int axis = 0; axis < Dim; ++axis) node[axis] -= box.lower[axis];
  std::vector<Correction<Dim>> out;
  for (Candidate<Dim>& candidate : Corrector<Dim>(scene, first, box.lower, stop).all())
    out.push_back({candidate.after.moved_to(box.lower), candidate.family, candidate.is_whole,
                   candidate.score, candidate.kept});
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                       \
  template std::vector<Correction<Dim>> corrections<Dim>(                           \
      const SearchGrid<Dim>&, const NodeSet<Dim>&, std::span<const GridClick<Dim>>, \
      std::span<const SettledRegion<Dim>>, double, const std::stop_token&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
