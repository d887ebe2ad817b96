// Operations one after another that are planned side by side ahead of their turns. Private to
// improve().
#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "libsurf/base/threads.h"
#include "libsurf/mesh/detail/star_patch.h"

namespace surf::mesh {

/// Whether a plan is made before the turn of its operation comes or then does not matter to what
/// comes out: one near which something has changed since is made anew.
///
/// @param items        in the order of their turns
/// @param vertices_of  (item): a pair of vertices. A plan looks at the star of the first, or at the
///                     stars of both and of their neighbours if the second is valid
/// @param may_try      (item): whether it is still to be tried
/// @param plan         (item, StarPatch&): optional of a plan; on several threads
/// @param carry_out    (item, const the plan&)
template <class Item, class VerticesOf, class MayTry, class Plan, class CarryOut>
void plan_ahead(const Mending& work, const std::vector<Item>& items, const VerticesOf& vertices_of,
                const MayTry& may_try, const Plan& plan, const CarryOut& carry_out) {
  using Planned = std::invoke_result_t<const Plan&, const Item&, StarPatch&>;
  constexpr std::size_t kAhead = 256;  // planned at once
  const bool is_alone = is_on_one_thread();
  tbb::enumerable_thread_specific<StarPatch> patches([&work] { return StarPatch(work); });
  // Of those whose stars meet one is planned ahead: where it is carried out the others would have
  // been planned for nothing.
  std::vector<int> last_window(work.mesh.n_vertices(), 0);  // of a plan that looks at the vertex
  int window = 0;
  const auto is_next_to_one = [&](const Item& item) {
    const auto [a, b] = vertices_of(item);
    return last_window[a.idx()] == window || (b.is_valid() && last_window[b.idx()] == window);
  };
  const auto take_surroundings = [&](VertexHandle vertex) {
    if (!vertex.is_valid()) return;
    last_window[vertex.idx()] = window;
    for (const VertexHandle neighbour : work.mesh.vv_range(vertex))
      last_window[neighbour.idx()] = window;
  };
  const auto has_changed = [&](const Item& item, int n_changes) {
    const auto [a, b] = vertices_of(item);
    if (!b.is_valid()) return work.last_change_at(a) > n_changes;
    return work.has_changed_round(a, n_changes) || work.has_changed_round(b, n_changes);
  };
  for (std::size_t first = 0, end = 0; first < items.size() && !work.is_stopped(); first = end) {
    ++window;
    std::vector<std::size_t> ahead;
    for (; end < items.size() && ahead.size() < kAhead; ++end) {
      if (is_alone || !may_try(items[end]) || is_next_to_one(items[end])) continue;
      const auto [a, b] = vertices_of(items[end]);
      take_surroundings(a);
      take_surroundings(b);
      ahead.push_back(end);
    }
    std::vector<Planned> plans(ahead.size());
    tbb::parallel_for(std::size_t(0), ahead.size(),
                      [&](std::size_t n) { plans[n] = plan(items[ahead[n]], patches.local()); });
    const int n_changes = work.n_changes();
    for (std::size_t at = first, n = 0; at < end; ++at) {
      if (work.is_stopped()) return;
      const bool is_planned = n < ahead.size() && ahead[n] == at;
      Planned its;
      if (is_planned) its = std::move(plans[n++]);
      if (!may_try(items[at])) continue;
      if (!is_planned || has_changed(items[at], n_changes)) its = plan(items[at], patches.local());
      if (its) carry_out(items[at], *its);
    }
  }
}

}  // namespace surf::mesh
