#include "libsurf/segment/click_search.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace surf::segment {
namespace {

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

/// Whether the last click has changed more than what is held round it.
template <int Dim>
bool has_answer(const ClickSearch<Dim>& search) {
  return !search.found.empty() && search.found.front().score > 0;
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
  out.inside = after.in(after.bounds(6));
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
  std::vector<double> scores, overlaps;
  for (const Correction<Dim>& correction : corrected) {
    scores.push_back(correction.score);
    overlaps.push_back(dice(correction.inside, corrected.front().inside));
  }
  if (corrected.front().score > 0) out->consent = consent_of(scores, overlaps);
  std::vector<Rung<Dim>> rungs;
  for (const Correction<Dim>& correction : corrected) rungs.push_back(rung_of(inside, correction));
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

template <int Dim>
bool have_all(const NodeSet<Dim>& inside, std::span<const GridClick<Dim>> clicks) {
  return std::all_of(clicks.begin(), clicks.end(),
                     [&](const auto& click) { return is_on_its_side(inside, click); });
}

/// The best region round any of the first clicks that has all clicks right, whether it stands out
/// or not: two clicks say more than one. Nothing if there is none.
template <int Dim>
std::vector<Rung<Dim>> found_by_all(const ClickSearch<Dim>& before, const ClickSearch<Dim>& anew) {
  std::vector<GridClick<Dim>> clicks = before.on_grid;
  clicks.insert(clicks.end(), anew.on_grid.begin(), anew.on_grid.end());
  const Rung<Dim>* best = nullptr;
  for (const auto& regions : {before.first, anew.first})
    for (const SettledRegion<Dim>& region : *regions)
      if ((!best || region.rung.score > best->score) &&
          have_all<Dim>(region.rung.inside.in(anew.box), clicks))
        best = &region.rung;
  if (!best) return {};
  return {*best};
}

/// What was found before and what has been found anew together, as one region.
template <int Dim>
ClickSearchPointer<Dim> joined(const ClickSearch<Dim>& anew, const NodeSet<Dim>& before) {
  auto out = std::make_shared<ClickSearch<Dim>>(anew);
  Rung<Dim> both = anew.found[anew.chosen];
  const NodeSet<Dim> inside = anew.inside() | before;
  both.inside = inside.in(inside.bounds(6));
  both.n_nodes = both.inside.count();
  out->found = {std::move(both)};
  out->chosen = 0;
  return out;
}

/// An inside click that what was found before has no answer to, if anything was: looked for as a
/// first one. Those before it are heeded after it, unless one of its regions has them right; where
/// that has no answer to an inside one, either, both regions are one.
template <int Dim>
ClickSearchPointer<Dim> search_anew(const SearchGrid<Dim>& grid,
                                    const ClickSearchPointer<Dim>& before, const Click<Dim>& click,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  ClickSearchPointer<Dim> anew = first_stroke<Dim>(grid, click, options, progress, stop);
  if (!anew) return nullptr;
  auto first = std::make_shared<ClickSearch<Dim>>(*anew);
  const auto has_all = [&](const Rung<Dim>& rung) {
    return have_all<Dim>(rung.inside.in(grid.box()), before->on_grid);
  };
  std::stable_partition(first->found.begin(), first->found.end(), has_all);
  if (first->found.empty() && before->found.empty())
    first->found = found_by_all<Dim>(*before, *first);
  anew = first;
  if (anew->found.empty()) return anew;
  for (const Click<Dim>& earlier : before->clicks) {
    ClickSearchPointer<Dim> next = further_search<Dim>(grid, anew, earlier, options, stop);
    if (!next) return nullptr;
    if (earlier.side == Side::kInside && !before->found.empty() && !has_answer(*next))
      next = joined<Dim>(*next, before->inside());
    anew = std::move(next);
  }
  auto out = std::make_shared<ClickSearch<Dim>>(*anew);
  out->before = before;
  out->clicks = before->clicks;
  out->clicks.push_back(click);
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> next_search(const SearchGrid<Dim>& grid,
                                    const ClickSearchPointer<Dim>& before, const Click<Dim>& click,
                                    const SearchOptions& options,
                                    const SearchProgress<Dim>& progress,
                                    const std::stop_token& stop) {
  if (!before->found.empty() || click.side != Side::kInside) {
    const auto next = further_search<Dim>(grid, before, click, options, stop);
    if (!next || click.side != Side::kInside || has_answer(*next)) return next;
  }
  const auto anew = search_anew<Dim>(grid, before, click, options, progress, stop);
  if (!anew || !anew->found.empty()) return anew;
  return further_search<Dim>(grid, before, click, options, stop);
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
    if (evolved && !known->found.empty() && !known->has_evolved &&
        is_on_its_side(known->inside(), on_grid(grid, next)))
      if (ClickSearchPointer<Dim> seen = evolved(known, next)) known = std::move(seen);
    known = next_search(grid, known, next, options, progress, stop);
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
  rung.inside = inside.in(inside.bounds(6));
  rung.n_nodes = rung.inside.count();
  out->has_evolved = true;
  out->before = search;
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> with_regions(const ClickSearch<Dim>& search,
                                     const ClickSearch<Dim>& before) {
  auto out = std::make_shared<ClickSearch<Dim>>(search);
  out->found = before.found;
  out->chosen = before.chosen;
  out->has_evolved = before.has_evolved;
  out->consent = before.consent;
  return out;
}

template <int Dim>
ClickSearchPointer<Dim> before_evolutions(ClickSearchPointer<Dim> search) {
  for (auto at = search; at; at = at->before)
    if (at->has_evolved) search = at->before;
  return search;
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
  template std::vector<Region<Dim>> regions<Dim>(const SearchGrid<Dim>&, const ClickSearch<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
