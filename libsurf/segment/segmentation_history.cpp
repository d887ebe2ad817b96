// The past of a segmentation: what is undone, repeated, dropped and made again.
#include <algorithm>
#include <limits>
#include <set>

#include "libsurf/base/error.h"
#include "libsurf/segment/segmentation.h"

namespace surf::segment {

template <int Dim>
bool Segmentation<Dim>::undo(Id id) {
  History<Dim>& history = find(id);
  if (!history.undo()) return false;
  try {
    check_name(history.now().name, id);
  } catch (const UsageError&) {
    history.redo();
    throw;
  }
  return true;
}

template <int Dim>
bool Segmentation<Dim>::redo(Id id) {
  History<Dim>& history = find(id);
  if (!history.can_redo()) return false;
  // First: what is between goes with the redo, and no undo brings it back.
  check_name(history.moments[history.n_done].after.name, id);
  return history.redo();
}

template <int Dim>
std::vector<Action<Dim>> Segmentation<Dim>::history(Id id) const {
  return find(id).actions();
}

template <int Dim>
void Segmentation<Dim>::apply(Id id, const Action<Dim>& action, const ProgressOf<Dim>& progress,
                              const std::stop_token& stop) {
  struct Visitor {
    Segmentation& s;
    Id id;
    const ProgressOf<Dim>& progress;
    const std::stop_token& stop;

    void operator()(const AddClick<Dim>& a) { s.add_click_unchecked_beside(id, a.click); }
    void operator()(const TakeBackClick& a) { s.take_back_click(id, a.index); }
    void operator()(const SetOptions<Dim>& a) { s.set_options(id, a.options); }
    void operator()(const Propose<Dim>& a) { s.propose_beside(id, a.others, progress, stop); }
    void operator()(const Choose& a) { s.choose(id, a.proposal); }
    void operator()(const Rename& a) { s.rename(id, a.name); }
    void operator()(const Recolour& a) { s.recolour(id, a.colour); }
    void operator()(const Evolve<Dim>& a) {
      // What has to be made before it does not count as its own.
      if (!s.is_ready(id, progress, stop)) return;
      if (a.stopped_at == 0) {  // nothing came of it: to be told of its first step is too late
        std::stop_source stopped;
        stopped.request_stop();
        s.evolve_beside(id, a.others, progress, stopped.get_token());
        return;
      }
      int n_calls = 0;
      s.evolve_beside(
          id, a.others,
          [&](const auto& stage, const auto& record, const auto& shape) {
            n_calls += record.n_elements > 0;
            const bool goes_on = !a.stopped_at || n_calls < *a.stopped_at;
            return (!progress || progress(stage, record, shape)) && goes_on;
          },
          stop);
    }
  };
  std::visit(Visitor{*this, id, progress, stop}, action);
}

template <int Dim>
const Result<Dim>& Segmentation<Dim>::make(Id id, const ProgressOf<Dim>& progress,
                                           const std::stop_token& stop) {
  if (is_made(id) && find(id).has_settled()) return *object(id).result;
  History<Dim> whole = find(id);
  try {
    if (repeat(id, whole, progress, stop))
      for (std::size_t n = whole.n_before_repeated(); n < whole.n_done; ++n)
        whole.moments[n].after.result = find(id).moments[n].after.result;
  } catch (...) {
    find(id) = std::move(whole);
    throw;
  }
  find(id) = std::move(whole);
  drop_past();
  return *object(id).result;
}

/// make(), and whether all that it makes is there: not after a stop.
template <int Dim>
bool Segmentation<Dim>::is_ready(Id id, const ProgressOf<Dim>& progress,
                                 const std::stop_token& stop) {
  make(id, progress, stop);
  return is_made(id) && find(id).has_settled();
}

/// The history becomes that up to the present, with its last results; false after a stop.
template <int Dim>
bool Segmentation<Dim>::repeat(Id id, const History<Dim>& whole, const ProgressOf<Dim>& progress,
                               const std::stop_token& stop) {
  bool goes_on = true;
  const ProgressOf<Dim> told = [&](const auto& stage, const auto& record, const auto& shape) {
    return goes_on = goes_on && (!progress || progress(stage, record, shape));
  };
  History<Dim>& history = find(id);
  history.n_done = whole.n_before_repeated();
  history.moments.resize(history.n_done);
  // What is not there is not needed by what follows, nor made for its sake.
  const auto empty = std::make_shared<const Result<Dim>>();
  for (auto& moment : history.moments)
    if (!moment.after.is_made()) moment.after.result = empty;
  for (std::size_t n = history.n_done; n < whole.n_done; ++n) {
    const Action<Dim>& action = whole.moments[n].action;
    // Another object may have the name by now.
    if (std::holds_alternative<Rename>(action) || std::holds_alternative<Recolour>(action))
      history.add(action, history.now());
    else
      apply(id, action, told, stop);
    if (!goes_on || stop.stop_requested()) return false;
  }
  return true;
}

/// Results that are furthest from the present go first.
template <int Dim>
void Segmentation<Dim>::drop_past() {
  std::map<const Result<Dim>*, std::size_t> n_away_of;  // moments
  for (const auto& [id, history] : objects_)
    for (std::size_t n = 0; n < history.moments.size(); ++n) {
      const std::size_t n_away = std::max(n + 1, history.n_done) - std::min(n + 1, history.n_done);
      const auto known = n_away_of.try_emplace(history.moments[n].after.result.get(), n_away).first;
      known->second = std::min(known->second, n_away);
    }
  for (const auto& [id, history] : aside_)
    for (const auto& moment : history.moments)
      n_away_of.try_emplace(moment.after.result.get(), std::numeric_limits<std::size_t>::max());
  for (const auto& [id, history] : objects_)  // of the present, too
    if (const auto* moment = history.last_evolution(history.n_done))
      n_away_of[moment->after.result.get()] = 0;
  n_away_of.erase(result_to_be_made<Dim>().get());
  for (const auto* objects : {&objects_, &aside_})
    for (const auto& [id, history] : *objects) n_away_of.erase(history.first.result.get());
  std::vector<std::pair<std::size_t, const Result<Dim>*>> nearest_first;
  for (const auto& [result, n_away] : n_away_of) nearest_first.push_back({n_away, result});
  std::sort(nearest_first.begin(), nearest_first.end());
  std::size_t bytes = 0;
  std::set<const Result<Dim>*> dropped;
  for (const auto& [n_away, result] : nearest_first) {
    bytes += segment::memory_bytes<Dim>(*result);
    if (bytes > max_past_bytes_ && n_away > 0) dropped.insert(result);
  }
  for (auto* objects : {&objects_, &aside_})
    for (auto& [id, history] : *objects)
      for (auto& moment : history.moments)
        if (dropped.contains(moment.after.result.get()))
          moment.after.result = result_to_be_made<Dim>();
}

template <int Dim>
void Segmentation<Dim>::note(Id id, const Action<Dim>& action) {
  const bool is_computed = std::holds_alternative<Propose<Dim>>(action) ||
                           std::holds_alternative<Choose>(action) ||
                           std::holds_alternative<Evolve<Dim>>(action);
  if (!is_computed) return apply(id, action);
  Object<Dim> after = object(id);
  after.result = result_to_be_made<Dim>();
  find(id).add(action, std::move(after));
}

#define SURF_INSTANTIATE(Dim)                                                                    \
  template bool Segmentation<Dim>::undo(Id);                                                     \
  template bool Segmentation<Dim>::redo(Id);                                                     \
  template std::vector<Action<Dim>> Segmentation<Dim>::history(Id) const;                        \
  template void Segmentation<Dim>::apply(Id, const Action<Dim>&, const ProgressOf<Dim>&,         \
                                         const std::stop_token&);                                \
  template const Result<Dim>& Segmentation<Dim>::make(Id, const ProgressOf<Dim>&,                \
                                                      const std::stop_token&);                   \
  template bool Segmentation<Dim>::is_ready(Id, const ProgressOf<Dim>&, const std::stop_token&); \
  template bool Segmentation<Dim>::repeat(Id, const History<Dim>&, const ProgressOf<Dim>&,       \
                                          const std::stop_token&);                               \
  template void Segmentation<Dim>::drop_past();                                                  \
  template void Segmentation<Dim>::note(Id, const Action<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
