#include "libsurf/segment/click_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace surf::segment {
namespace {

constexpr int kMargin = 6;  // nodes round a region
// separation^3 * edge_share of a part that hangs on nothing: in six scans parts of the object have
// 0.2 to 0.8, crumbs in the midst of a noisy ball 0.08.
constexpr double kOwnBoundary = 0.1;
// Of what a click has brought as far as its surroundings go, in the region round it: a leak has
// less.
constexpr double kMostOfPart = 0.9;

// Of the nodes of the object as it was last judged and as it is, those that have changed and are
// not beside its boundary, where settling alone moves it: less says nothing of the rest.
constexpr double kSmallChange = 0.025;

/// The order in which clicks are heeded: the first inside one before all others.
template <int Dim>
std::vector<Click<Dim>> in_order(std::span<const Click<Dim>> clicks) {
  std::vector<Click<Dim>> out(clicks.begin(), clicks.end());
  const auto first = std::find_if(
      out.begin(), out.end(), [](const Click<Dim>& click) { return click.side == Side::kInside; });
  if (first == out.end()) return {};
  std::rotate(out.begin(), first, first + 1);
  return out;
}

/// A stroke has the nodes of all its points, and the look of its first.
template <int Dim>
GridClick<Dim> on_grid(const SearchGrid<Dim>& grid, const Click<Dim>& click) {
  GridClick<Dim> out{seed_nodes(grid, click.point_mm), click.side};
  const auto to_index = grid.node_to_world().inverse();
  auto& nodes = out.seed.nodes;
  for (const Vector<Dim>& point : click.stroke_mm) {
    const auto here = nearest_nodes<Dim>(to_index * point, grid.box().size);
    nodes.insert(nodes.end(), here.begin(), here.end());
  }
  if (click.stroke_mm.empty()) return out;
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return out;
}

template <int Dim>
bool is_on_its_side(const NodeSet<Dim>& inside, const GridClick<Dim>& click) {
  return std::all_of(click.seed.nodes.begin(), click.seed.nodes.end(), [&](const auto& node) {
    return inside.contains(node) == (click.side == Side::kInside);
  });
}

/// Whether a part of what was found in a box of the grid goes on beyond the box.
template <int Dim>
bool goes_on_beyond(const NodeBox<Dim>& grid, const NodeBox<Dim>& box, const NodeBox<Dim>& part) {
  for (int axis = 0; axis < Dim; ++axis) {
    const int end = box.upper()[axis];
    if (box.lower[axis] > 0 && part.lower[axis] <= box.lower[axis]) return true;
    if (end < grid.size[axis] && part.upper()[axis] >= end) return true;
  }
  return false;
}

/// Whether a part has a boundary of its own, and is no crumb in the midst of something.
template <int Dim>
bool part_stands_out(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search,
                     const NodeSet<Dim>& part, const std::stop_token& stop) {
  if (double(part.count()) < nodes_of_ball<Dim>(kLeastObjectRadius)) return false;
  const NodeBox<Dim> box = part.bounds(kMargin);
  const SearchGrid<Dim> here = grid.part(box, stop);
  Rung<Dim> rung;
  rung.inside = part.in(box).moved_to({});
  measure(here.box(), here.level(),
          SeedView<Dim>(here, {search.on_grid.back().seed}, search.noise).edge, rung);
  return std::pow(rung.features.separation, 3) * rung.features.edge_share > kOwnBoundary;
}

/// What the last click, an inside one, has brought.
enum class Answer {
  kNothing,  ///< but what is held round it, or a crumb that hangs on nothing
  kCutOff,   ///< it goes on beyond its surroundings
  kWhole
};

template <int Dim>
Answer answer_of(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search,
                 const NodeSet<Dim>& before, const std::stop_token& stop) {
  const GridClick<Dim>& click = search.on_grid.back();
  if (is_on_its_side(before, click)) return Answer::kWhole;
  const NodeSet<Dim> inside = search.inside();
  if (!is_on_its_side(inside, click)) return Answer::kNothing;
  const NodeSet<Dim> part = inside.component(click.seed.nodes), added = part - before;
  if (part.count_in_both(before) == 0 && !part_stands_out(grid, search, part, stop))
    return Answer::kNothing;
  return goes_on_beyond(grid.box(), surroundings<Dim>(grid, before, search.on_grid),
                        added.bounds(0))
             ? Answer::kCutOff
             : Answer::kWhole;
}

template <int Dim>
double dice(const NodeSet<Dim>& a, const NodeSet<Dim>& b) {
  const std::size_t sum = a.count() + b.count();
  return sum > 0 ? 2 * double(a.count_in_both(b)) / double(sum) : 1;
}

/// The object after a correction, on the whole grid, as a rung.
template <int Dim>
Rung<Dim> rung_of(const NodeSet<Dim>& before, const Correction<Dim>& correction) {
  const NodeBox<Dim>& grid = before.box();
  const NodeSet<Dim> unchanged = before - before.in(correction.inside.box()).in(grid),
                     after = unchanged | correction.inside.in(grid);
  Rung<Dim> out;
  out.family = correction.family;
  out.score = correction.score;
  out.kept = correction.kept;
  out.inside = after.in(after.bounds(kMargin));
  out.n_nodes = out.inside.count();
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> first_search(const SearchGrid<Dim>& grid, const Click<Dim>& click,
                                     const SearchOptions& options,
                                     const SearchProgress<Dim>& progress,
                                     const std::stop_token& stop) {
  auto out = std::make_shared<ClickSearch<Dim>>();
  out->box = grid.box();
  out->clicks = {click};
  out->on_grid = {on_grid(grid, click)};
  out->noise = out->on_grid.front().seed.model.noise;
  SearchedRegions<Dim> searched =
      search_outward<Dim>(grid, click.point_mm, options, progress, stop);
  if (searched.was_stopped) return nullptr;
  out->first = std::make_shared<const std::vector<SettledRegion<Dim>>>(std::move(searched.settled));
  out->found = std::move(searched.found);
  return out;
}

/// That which its verdict is of.
template <int Dim>
const ClickSearch<Dim>& last_judged(const ClickSearch<Dim>& search) {
  const ClickSearch<Dim>* at = &search;
  while (at->says_little && at->before) at = at->before.get();
  return *at;
}

template <int Dim>
double share_of_change(const NodeSet<Dim>& before, const NodeSet<Dim>& after) {
  const NodeSet<Dim> beside = before.dilated(1) & before.complement().dilated(1);
  return double(((before ^ after) - beside).count()) /
         std::max(1.0, double(before.count() + after.count()));
}

template <int Dim>
ClickSearchPointer<Dim> further_search(const SearchGrid<Dim>& grid,
                                       const ClickSearchPointer<Dim>& before,
                                       const Click<Dim>& click, const SearchOptions& options,
                                       const std::stop_token& stop) {
  auto out = std::make_shared<ClickSearch<Dim>>(*before);
  out->before = before;
  out->clicks.push_back(click);
  out->on_grid.push_back(on_grid(grid, click));
  if (before->found.empty()) return out;
  const NodeSet<Dim> inside = before->inside();
  if (is_on_its_side(inside, out->on_grid.back())) return out;
  const auto corrected =
      corrections<Dim>(grid, inside, out->on_grid, *out->first, out->noise, stop);
  if (stop.stop_requested()) return nullptr;
  if (!(corrected.front().score > 0)) return out;  // nothing comes of it: all stays
  std::vector<double> scores, overlaps;
  for (const Correction<Dim>& correction : corrected) {
    scores.push_back(correction.score);
    overlaps.push_back(dice(correction.inside, corrected.front().inside));
  }
  std::vector<Rung<Dim>> rungs;
  for (const Correction<Dim>& correction : corrected) rungs.push_back(rung_of(inside, correction));
  out->says_little = share_of_change(last_judged(*before).inside(),
                                     rungs.front().inside.in(grid.box())) < kSmallChange;
  if (!out->says_little)
    out->consent = consent_of(scores, overlaps);
  else
    rungs.front().kept = before->found[before->chosen].kept;
  std::vector<const Rung<Dim>*> all;
  for (const Rung<Dim>& rung : rungs) all.push_back(&rung);
  out->has_evolved = false;
  out->found.clear();
  for (const Rung<Dim>* rung :
       differing(all, std::size_t(options.max_regions), SearchOptions::kMostOverlapOfCorrections))
    out->found.push_back(*rung);
  out->chosen = 0;
  return out;
}

/// Of a stroke first its point alone, then all of it as a further click.
template <int Dim>
ClickSearchPointer<Dim> first_stroke(const SearchGrid<Dim>& grid, const Click<Dim>& stroke,
                                     const SearchOptions& options,
                                     const SearchProgress<Dim>& progress,
                                     const std::stop_token& stop) {
  const Click<Dim> point{stroke.point_mm, stroke.side};
  auto first = first_search<Dim>(grid, point, options, progress, stop);
  if (!first || stroke.stroke_mm.empty()) return first;
  const auto whole = further_search<Dim>(grid, first, stroke, options, stop);
  if (!whole) return nullptr;
  auto out = std::make_shared<ClickSearch<Dim>>(*whole);
  out->clicks = {stroke};
  out->on_grid = {on_grid(grid, stroke)};
  out->before = nullptr;
  return out;
}

/// What was found before and what has been found anew together, as one region; edges hold it as
/// well as the one of the two that they hold less.
template <int Dim>
ClickSearchPointer<Dim> joined(const ClickSearch<Dim>& anew, const NodeSet<Dim>& before,
                               double kept_before) {
  auto out = std::make_shared<ClickSearch<Dim>>(anew);
  Rung<Dim> both = anew.found[anew.chosen];
  const NodeSet<Dim> inside = anew.inside() | before;
  both.inside = inside.in(inside.bounds(kMargin));
  both.n_nodes = both.inside.count();
  both.kept = std::min(both.kept, kept_before);
  out->found = {std::move(both)};
  out->chosen = 0;
  out->says_little = false;
  out->consent.reset();
  return out;
}

/// An inside click that what was found before has no answer to, if anything was, as a first one:
/// of its regions those come first that have the clicks before it right. Else these are heeded
/// after it; where it has no answer to an inside one, either, both regions are one.
template <int Dim>
ClickSearchPointer<Dim> search_anew(const SearchGrid<Dim>& grid,
                                    const ClickSearchPointer<Dim>& before, const Click<Dim>& click,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  const auto first = first_stroke<Dim>(grid, click, options, progress, stop);
  if (!first || first->found.empty()) return first;
  auto ordered = std::make_shared<ClickSearch<Dim>>(*first);
  std::stable_partition(ordered->found.begin(), ordered->found.end(), [&](const Rung<Dim>& rung) {
    const NodeSet<Dim> inside = rung.inside.in(grid.box());
    return std::all_of(before->on_grid.begin(), before->on_grid.end(),
                       [&](const auto& earlier) { return is_on_its_side(inside, earlier); });
  });
  ordered->consent.reset();
  ClickSearchPointer<Dim> anew = std::move(ordered);
  for (const Click<Dim>& earlier : before->clicks) {
    ClickSearchPointer<Dim> next = further_search<Dim>(grid, anew, earlier, options, stop);
    if (!next) return nullptr;
    if (earlier.side == Side::kInside && !before->found.empty() &&
        answer_of(grid, *next, anew->inside(), stop) == Answer::kNothing)
      next = joined<Dim>(*next, before->inside(), before->found[before->chosen].kept);
    anew = std::move(next);
  }
  auto out = std::make_shared<ClickSearch<Dim>>(*anew);
  out->before = before;
  out->says_little = false;  // of what was found before, which is another region or none
  out->clicks = before->clicks;
  out->clicks.push_back(click);
  return out;
}

/// Whether the click stands against one other alone, which nobody has looked at closer: once there
/// are two, or a region was chosen, or has evolved, one of which nothing comes is a corner of that.
/// A stroke says itself what belongs to the object.
template <int Dim>
bool may_begin_anew(const ClickSearch<Dim>& before, const Click<Dim>& click) {
  if (click.side != Side::kInside || before.found.empty()) return click.side == Side::kInside;
  return before.clicks.size() == 1 && click.stroke_mm.empty() && before.chosen == 0 &&
         !before.has_evolved;
}

template <int Dim>
ClickSearchPointer<Dim> next_search(const SearchGrid<Dim>& grid,
                                    const ClickSearchPointer<Dim>& before, const Click<Dim>& click,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  const auto next = further_search<Dim>(grid, before, click, options, stop);
  if (!next || !may_begin_anew(*before, click)) return next;
  const Answer answer =
      before->found.empty() ? Answer::kNothing : answer_of(grid, *next, before->inside(), stop);
  if (answer == Answer::kWhole) return next;
  const auto anew = search_anew<Dim>(grid, before, click, options, progress, stop);
  if (!anew) return nullptr;
  if (anew->found.empty()) return next;
  const NodeSet<Dim> seen = next->inside();  // what goes on is a part of the whole
  const bool has_it = answer == Answer::kNothing || double(anew->inside().count_in_both(seen)) >=
                                                        kMostOfPart * double(seen.count());
  return has_it ? anew : next;
}

}  // namespace

template <int Dim>
NodeSet<Dim> ClickSearch<Dim>::inside() const {
  return found.empty() ? NodeSet<Dim>() : found[chosen].inside.in(box);
}

double consent_of(std::span<const double> scores, std::span<const double> overlaps) {
  return std::inner_product(scores.begin(), scores.end(), overlaps.begin(), 0.0) /
         std::accumulate(scores.begin(), scores.end(), 0.0);
}

template <int Dim>
ClickSearchPointer<Dim> search_clicks(const SearchGrid<Dim>& grid,
                                      std::span<const Click<Dim>> clicks,
                                      ClickSearchPointer<Dim> known, const SearchOptions& options,
                                      const SearchProgress<Dim>& progress,
                                      const std::stop_token& stop, const EvolvedOf<Dim>& evolved) {
  const std::vector<Click<Dim>> ordered = in_order<Dim>(clicks);
  if (ordered.empty()) return nullptr;
  const auto is_start = [&](const ClickSearch<Dim>& search) {
    return search.clicks.size() <= ordered.size() &&
           std::equal(search.clicks.begin(), search.clicks.end(), ordered.begin());
  };
  while (known && !is_start(*known)) known = known->before;
  if (!known) known = first_stroke<Dim>(grid, ordered.front(), options, progress, stop);
  while (known && known->clicks.size() < ordered.size()) {
    const Click<Dim>& next = ordered[known->clicks.size()];
    bool has_asked = known->has_asked;
    if (evolved && !known->found.empty() && !known->has_evolved &&
        is_on_its_side(known->inside(), on_grid(grid, next))) {
      has_asked = true;
      if (ClickSearchPointer<Dim> seen = evolved(known, next)) known = std::move(seen);
    }
    known = next_search(grid, known, next, options, progress, stop);
    if (!known || known->has_asked == has_asked) continue;
    auto out = std::make_shared<ClickSearch<Dim>>(*known);
    out->has_asked = has_asked;
    known = std::move(out);
  }
  return known;
}

template <int Dim>
ClickSearchPointer<Dim> with_choice(const ClickSearch<Dim>& search, std::size_t chosen) {
  auto out = std::make_shared<ClickSearch<Dim>>(search);
  out->chosen = chosen;
  out->has_evolved = search.has_evolved && chosen == search.chosen;
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> with_evolved(const ClickSearchPointer<Dim>& search,
                                     const NodeSet<Dim>& inside) {
  auto out = std::make_shared<ClickSearch<Dim>>(*search);
  Rung<Dim>& rung = out->found[out->chosen];
  rung.inside = inside.in(inside.bounds(kMargin));
  rung.n_nodes = rung.inside.count();
  out->has_evolved = true;
  out->before = search;
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> with_regions(const ClickSearch<Dim>& search,
                                     const ClickSearch<Dim>& before) {
  auto out = std::make_shared<ClickSearch<Dim>>(before);
  out->before = search.before;
  out->has_asked = search.has_asked;
  out->clicks = search.clicks;
  for (const GridClick<Dim>& click : search.on_grid) {
    const bool is_known =
        std::any_of(before.on_grid.begin(), before.on_grid.end(), [&](const auto& known) {
          return known.side == click.side && known.seed.nodes == click.seed.nodes;
        });
    if (!is_known) out->on_grid.push_back(click);
  }
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> before_evolutions(ClickSearchPointer<Dim> search) {
  for (auto at = search; at; at = at->before)
    if (at->has_evolved) search = at->before;
  return search;
}

template <int Dim>
const ClickSearch<Dim>* common_start(const ClickSearch<Dim>* a, const ClickSearch<Dim>* b) {
  for (; a; a = a->before.get())
    for (const ClickSearch<Dim>* of_b = b; of_b; of_b = of_b->before.get())
      if (a == of_b) return a;
  return nullptr;
}

template <int Dim>
std::vector<Region<Dim>> regions(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search) {
  std::vector<Region<Dim>> out;
  for (const Rung<Dim>& rung : search.found) {
    const NodeBox<Dim>& box = rung.inside.box();
    const SearchGrid<Dim> part = grid.part(box);
    const SeedView<Dim> view(part, {search.on_grid.front().seed}, search.noise);
    Rung<Dim> here = rung;
    here.inside = rung.inside.moved_to({});
    out.push_back(region_of(view, here));
  }
  return out;
}

#define SURF_INSTANTIATE(Dim)                                                              \
  template struct ClickSearch<Dim>;                                                        \
  template ClickSearchPointer<Dim> search_clicks<Dim>(                                     \
      const SearchGrid<Dim>&, std::span<const Click<Dim>>, ClickSearchPointer<Dim>,        \
      const SearchOptions&, const SearchProgress<Dim>&, const std::stop_token&,            \
      const EvolvedOf<Dim>&);                                                              \
  template ClickSearchPointer<Dim> with_choice<Dim>(const ClickSearch<Dim>&, std::size_t); \
  template ClickSearchPointer<Dim> with_evolved<Dim>(const ClickSearchPointer<Dim>&,       \
                                                     const NodeSet<Dim>&);                 \
  template ClickSearchPointer<Dim> with_regions<Dim>(const ClickSearch<Dim>&,              \
                                                     const ClickSearch<Dim>&);             \
  template ClickSearchPointer<Dim> before_evolutions<Dim>(ClickSearchPointer<Dim>);        \
  template const ClickSearch<Dim>* common_start<Dim>(const ClickSearch<Dim>*,              \
                                                     const ClickSearch<Dim>*);             \
  template std::vector<Region<Dim>> regions<Dim>(const SearchGrid<Dim>&, const ClickSearch<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
