#include "libsurf/segment/segmentation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/segment/clicks.h"
#include "libsurf/segment/detail/amend.h"
#include "libsurf/segment/detail/run_stages.h"
#include "libsurf/segment/detail/work_json.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

// Colours of objects one after the other, told apart by the colour-blind too (Okabe and Ito, 2008).
constexpr std::array<Colour, 7> kColours = {{{230, 159, 0},
                                             {86, 180, 233},
                                             {0, 158, 115},
                                             {240, 228, 66},
                                             {0, 114, 178},
                                             {213, 94, 0},
                                             {204, 121, 167}}};

/// What further clicks go on from; null where nothing has come to rest by itself.
template <int Dim>
std::shared_ptr<const Result<Dim>> settled_without_energy(const History<Dim>& history) {
  const auto out = history.settled();
  return history.now().options.energies.empty() && out && out->search ? out : nullptr;
}

/// @throws UsageError  there is no such click
template <int Dim>
Object<Dim> without_click(Object<Dim> object, std::size_t index) {
  if (index >= object.clicks.size())
    throw UsageError(fmt::format("click {} is unknown; '{}' has {}, counted from 0", index,
                                 object.name, object.clicks.size()));
  object.clicks.erase(object.clicks.begin() + std::ptrdiff_t(index));
  return object;
}

}  // namespace

template <int Dim>
Segmentation<Dim>::Segmentation(std::shared_ptr<const Setting<Dim>> setting, std::size_t max_bytes,
                                std::size_t max_past_bytes)
    : fields_(std::move(setting), max_bytes), max_past_bytes_(max_past_bytes) {}

template <int Dim>
History<Dim>& Segmentation<Dim>::find(Id id) {
  const auto found = objects_.find(id);
  if (found == objects_.end())
    throw UsageError(fmt::format(
        "object {} is unknown; there {}", id,
        objects_.empty() ? "is none" : fmt::format("are {}", fmt::join(objects(), ", "))));
  return found->second;
}

template <int Dim>
const History<Dim>& Segmentation<Dim>::find(Id id) const {
  return const_cast<Segmentation*>(this)->find(id);
}

template <int Dim>
bool Segmentation<Dim>::has_name(const std::string& name, Id besides) const {
  return std::any_of(objects_.begin(), objects_.end(), [&](const auto& entry) {
    return entry.first != besides && entry.second.now().name == name;
  });
}

template <int Dim>
void Segmentation<Dim>::check_name(const std::string& name, Id besides) const {
  if (has_name(name, besides))
    throw UsageError(fmt::format("Object::name: there is an object '{}' already", name));
}

template <int Dim>
typename Segmentation<Dim>::Id Segmentation<Dim>::add_object(const std::string& name,
                                                             const std::optional<Colour>& colour) {
  Object<Dim> object;
  object.name = name.empty() ? fmt::format("object {}", next_) : name;
  // A recipe's objects have names of other numbers than theirs.
  for (Id n = next_; name.empty() && has_name(object.name, 0);)
    object.name = fmt::format("object {}", ++n);
  check_name(object.name, 0);
  object.colour = colour.value_or(kColours[std::size_t(next_ - 1) % kColours.size()]);
  object.result = std::make_shared<const Result<Dim>>();
  objects_[next_].first = std::move(object);
  return next_++;
}

template <int Dim>
void Segmentation<Dim>::remove_object(Id id) {
  find(id);
  objects_.erase(id);
}

template <int Dim>
void Segmentation<Dim>::set_aside(Id id) {
  find(id);
  aside_.insert(objects_.extract(id));
}

template <int Dim>
void Segmentation<Dim>::bring_back(Id id) {
  const auto found = aside_.find(id);
  if (found == aside_.end()) throw UsageError(fmt::format("object {} has not been set aside", id));
  check_name(found->second.now().name, id);
  objects_.insert(aside_.extract(found));
}

template <int Dim>
std::vector<typename Segmentation<Dim>::Id> Segmentation<Dim>::objects() const {
  std::vector<Id> out;
  for (const auto& [id, history] : objects_) out.push_back(id);
  return out;
}

template <int Dim>
const Object<Dim>& Segmentation<Dim>::object(Id id) const {
  return find(id).now();
}

template <int Dim>
void Segmentation<Dim>::add_click(Id id, const Click<Dim>& click) {
  find(id);
  check_beside_others(id, click);
  add_click_unchecked_beside(id, click);
}

template <int Dim>
void Segmentation<Dim>::check_beside_others(Id id, const Click<Dim>& click) const {
  for (const auto& [other, history] : objects_)
    if (other != id)
      check_beside<Dim>(setting().extent(), history.now().clicks, history.now().name, click);
}

/// What a recipe repeats was checked when it was done; the others may be as they are later.
template <int Dim>
void Segmentation<Dim>::add_click_unchecked_beside(Id id, const Click<Dim>& click) {
  Object<Dim> after = with_click(object(id), click);
  find(id).add(AddClick<Dim>{click}, std::move(after));
}

template <int Dim>
Object<Dim> Segmentation<Dim>::with_click(Object<Dim> object, const Click<Dim>& click) const {
  if (object.clicks.size() >= kMostClicks)
    throw UsageError(fmt::format(
        "Object::clicks: more than {} clicks and strokes on '{}'; paint fewer and larger "
        "ones: each connected stroke is one click",
        kMostClicks, object.name));
  check_click<Dim>(setting().extent(), object.clicks, click);
  check_box<Dim>(setting().extent(), object.options.box_mm, {click});
  object.clicks.push_back(click);
  return object;
}

/// The inside clicks of all other objects, as outside clicks.
template <int Dim>
std::vector<Click<Dim>> Segmentation<Dim>::checked_others_of(Id id) const {
  for (const Click<Dim>& click : object(id).clicks) check_beside_others(id, click);
  return others_of(id);
}

template <int Dim>
std::vector<Click<Dim>> Segmentation<Dim>::others_of(Id id) const {
  std::vector<Click<Dim>> out;
  for (const auto& [other, history] : objects_) {
    if (other == id) continue;
    const std::vector<Click<Dim>> clicks = as_outside<Dim>(history.now().clicks);
    out.insert(out.end(), clicks.begin(), clicks.end());
  }
  return out;
}

template <int Dim>
void Segmentation<Dim>::take_back_click(Id id, std::size_t index) {
  Object<Dim> after = without_click<Dim>(object(id), index);
  find(id).add(TakeBackClick{index}, std::move(after));
}

// All checks come first: an entry that is added takes with it what could be redone.
template <int Dim>
void Segmentation<Dim>::move_click(Id id, std::size_t index, const Vector<Dim>& point_mm) {
  Object<Dim> without = without_click<Dim>(object(id), index);
  const Click<Dim> click{point_mm, object(id).clicks[index].side};
  check_beside_others(id, click);
  Object<Dim> after = with_click(without, click);
  find(id).add(TakeBackClick{index}, std::move(without));
  find(id).add(AddClick<Dim>{click}, std::move(after));
}

template <int Dim>
void Segmentation<Dim>::set_options(Id id, const Options<Dim>& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  check_terms<Dim>(options.energies);
  for (const Vector<Dim>& point : options.samples_mm)
    check_click<Dim>(setting().extent(), {}, {point, Side::kInside});
  check_lengths<Dim>(setting().extent(), options);
  Object<Dim> after = object(id);
  check_box<Dim>(setting().extent(), options.box_mm, after.clicks);
  const bool is_sought = options.energies.empty() && after.options.energies.empty() &&
                         !points_on<Dim>(Side::kInside, after.clicks).empty();
  if (is_sought && options.box_mm != after.options.box_mm) {
    // What was found without it, or in another one, is no answer any more.
    after.result = std::make_shared<const Result<Dim>>();
  } else if (!has_same_grid(options, after.options) && after.result->search) {
    Result<Dim> result = *after.result;
    result.search = nullptr;
    after.result = std::make_shared<const Result<Dim>>(std::move(result));
  }
  after.options = options;
  find(id).add(SetOptions<Dim>{options}, std::move(after));
}

template <int Dim>
void Segmentation<Dim>::rename(Id id, const std::string& name) {
  if (name.empty()) throw UsageError("Object::name is empty");
  check_name(name, id);
  Object<Dim> after = object(id);
  after.name = name;
  find(id).add(Rename{name}, std::move(after));
}

template <int Dim>
void Segmentation<Dim>::recolour(Id id, const Colour& colour) {
  Object<Dim> after = object(id);
  after.colour = colour;
  find(id).add(Recolour{colour}, std::move(after));
}

template <int Dim>
Work<Dim> Segmentation<Dim>::work_for(const Object<Dim>& object,
                                      const std::vector<Click<Dim>>& others,
                                      const ProgressOf<Dim>& progress,
                                      const std::stop_token& stop) {
  std::vector<Vector<Dim>> seeds = points_on<Dim>(Side::kInside, object.clicks);
  if (seeds.empty()) seeds = object.options.samples_mm;
  std::vector<Click<Dim>> clicks = others;
  clicks.insert(clicks.end(), object.clicks.begin(), object.clicks.end());
  Work<Dim> out{{}, fields_, object.options, std::move(seeds), std::move(clicks), progress, stop};
  out.n_others = others.size();
  out.search = object.result->search;
  return out;
}

template <int Dim>
const Result<Dim>& Segmentation<Dim>::propose_beside(Id id, const std::vector<Click<Dim>>& others,
                                                     const ProgressOf<Dim>& progress,
                                                     const std::stop_token& stop) {
  if (!is_ready(id, progress, stop)) return *object(id).result;
  Object<Dim> after = object(id);
  Work<Dim> work = work_for(after, others, progress, stop);
  if (work.seeds_mm.empty())
    throw UsageError(fmt::format("'{}' has no inside click to look for it", after.name));
  work.settled = settled_without_energy(find(id));
  run_proposal(work);
  fields_.shrink();
  if (!work.is_stopped()) {
    after.result = std::make_shared<const Result<Dim>>(to_result(std::move(work)));
    find(id).add(Propose<Dim>{others}, std::move(after));
    drop_past();
  }
  return *object(id).result;
}

template <int Dim>
void Segmentation<Dim>::prepare() {
  fields_.search_grid(field_options(Options<Dim>(), 0), {})->make_all();
}

template <int Dim>
std::vector<Candidate<Dim>> Segmentation<Dim>::candidates(Id id) {
  const Object<Dim>& now = object(id);
  if (!now.result->search) return {};
  return segment::candidates<Dim>(setting(), *grid_for(now.options), *now.result->search);
}

/// The grid of the search.
template <int Dim>
std::shared_ptr<const SearchGrid<Dim>> Segmentation<Dim>::grid_for(const Options<Dim>& options) {
  return fields_.search_grid(field_options(options, 0), options.sigma_mm, options.box_mm);
}

template <int Dim>
const Result<Dim>& Segmentation<Dim>::choose(Id id, std::size_t proposal) {
  Object<Dim> after = object(id);
  if (proposal >= after.result->proposals.size())
    throw UsageError(fmt::format("proposal {} is unknown; '{}' has {}, counted from 0", proposal,
                                 after.name, after.result->proposals.size()));
  Result<Dim> chosen;
  chosen.proposals = after.result->proposals;
  if (after.result->search) {
    chosen.search = with_choice(*after.result->search, chosen.proposals[proposal].place);
    chosen.verdict = verdict(*grid_for(after.options), *chosen.search);
    chosen.verdict_of_region = chosen.verdict;
    fields_.shrink();
  }
  chosen.chosen = proposal;
  chosen.shape = chosen.proposals[proposal].shape;
  chosen.outcome = Outcome::kProposed;
  chosen.message = to_string(chosen.proposals[proposal]);
  after.result = std::make_shared<const Result<Dim>>(std::move(chosen));
  find(id).add(Choose{proposal}, std::move(after));
  drop_past();
  return *object(id).result;
}

template <int Dim>
Result<Dim> Segmentation<Dim>::evolved(const History<Dim>& history,
                                       const std::vector<Click<Dim>>& others,
                                       const ProgressOf<Dim>& progress, const std::stop_token& stop,
                                       bool& is_anew) {
  const Object<Dim>& object = history.now();
  const Result<Dim>& before = *object.result;
  Work<Dim> work = work_for(object, others, progress, stop);
  work.proposals = before.proposals;
  work.chosen = before.chosen;
  const std::vector<Click<Dim>> searched =
      clicks_in_box<Dim>(setting().extent(), object.options.box_mm, work.clicks);
  // A click that was taken back takes with it what it stood for.
  const bool has_lost = before.search && !contains_all<Dim>(searched, before.search->clicks);
  // What was proposed for these clicks is an answer to them; what was evolved has to heed them.
  const bool is_answer = before.outcome == Outcome::kProposed && before.search && !has_lost &&
                         before.search->clicks.size() == searched.size();
  // What has come to its end and is to evolve by other options: an energy that is fitted to its
  // start would be fitted to what it has found, again and again. It begins where it began.
  // But for another region than the best, where a search or what it saw is not there any more: that
  // one was chosen.
  const bool is_choice_lost =
      before.chosen != 0 && (!before.search || is_amended<Dim>(before.shape));
  const bool is_fitted = object.options.energies.empty() && !is_choice_lost &&
                         (!work.seeds_mm.empty() || object.options.initial.has_value());
  // Clicks that an explicit energy has heeded are in no search.
  const bool may_go_on = !has_lost && has_shape(before.outcome) &&
                         before.shape.elements.rows() > 0 &&
                         (object.options.energies.empty() || !history.has_lost_click(work.clicks));
  const bool goes_on = is_answer || (may_go_on && (!is_fitted || history.unfinished()) &&
                                     heeds<Dim>(before.shape, work.clicks));
  // Without an energy the clicks say more of the object than a body to start from does.
  const bool uses_initial =
      object.options.initial && (!object.options.energies.empty() || work.seeds_mm.empty());
  if (object.options.initial && !uses_initial && !goes_on)
    work.notes.push_back(
        "the initial shape is not used: without an energy the object is looked for");
  if (goes_on)
    work.shape = before.shape;
  else if (uses_initial)
    work.shape = *object.options.initial;
  else if (work.seeds_mm.empty())
    throw UsageError(fmt::format(
        "'{}' has nothing to start from: no inside click and no initial shape", object.name));
  if (!goes_on) work.proposals.clear();
  if (!goes_on && !object.options.energies.empty()) {
    work.search = nullptr;  // what it begins with comes from none
    work.chosen = 0;
  }
  work.start_is_given = goes_on || uses_initial;
  if (goes_on && object.options.energies.empty()) work.verdict = before.verdict_of_region;
  if (goes_on) work.unfinished = history.unfinished();
  if (is_answer || !goes_on) work.settled = settled_without_energy(history);
  run_stages(work, checkpointing_);
  fields_.shrink();
  // What was found earlier and is handed on is not of these clicks, or not of these options.
  const auto* handed_on = common_start<Dim>(work.search.get(), before.search.get());
  is_anew = !goes_on && !work.settled &&
            (!handed_on || (work.search != before.search && !handed_on->has_asked));
  return to_result(std::move(work));
}

namespace {

/// What has been found so far is left: a recipe knows of no moments before the first step, and is
/// to repeat what came of this one, whenever it was.
template <int Dim>
Result<Dim> stopped_before_first_step(const Result<Dim>& before, Result<Dim> stopped) {
  Result<Dim> out = before;
  out.outcome = stopped.outcome;
  out.message = std::move(stopped.message);
  // Of what it goes on from: how far this one has come before its first step depends on the moment.
  if (before.stages.empty()) out.stages = std::move(stopped.stages);
  out.notes = std::move(stopped.notes);
  return out;
}

}  // namespace

template <int Dim>
const Result<Dim>& Segmentation<Dim>::evolve_beside(Id id, const std::vector<Click<Dim>>& others,
                                                    const ProgressOf<Dim>& progress,
                                                    const std::stop_token& stop,
                                                    const std::function<bool()>& keeps_stopped,
                                                    bool keeps_undone) {
  if (!is_ready(id, progress, stop)) return *object(id).result;
  Object<Dim> after = object(id);
  Evolve<Dim> action{.others = others};
  if (find(id).is_at_rest(others, setting().extent())) {
    find(id).add(action, std::move(after), keeps_undone);
    return *object(id).result;
  }
  int n_calls = checkpointing_.state.empty() ? 0 : stages_done(checkpointing_.state).n_steps;
  const ProgressOf<Dim> counted = [&](const auto& stage, const auto& record, const auto& shape) {
    n_calls += record.n_elements > 0;
    return !progress || progress(stage, record, shape);
  };
  Result<Dim> result = evolved(find(id), others, counted, stop, action.is_anew);
  if (result.outcome == Outcome::kStopped) {
    if (keeps_stopped && !keeps_stopped()) return *object(id).result;
    // The search that is made again was stopped: nothing of the checkpoint is there.
    if (result.n_steps() == 0) n_calls = 0;
    action.stopped_at = n_calls;
    if (n_calls == 0) {
      result = stopped_before_first_step(*after.result, std::move(result));
      action.is_anew = false;
    }
  }
  after.result = std::make_shared<const Result<Dim>>(std::move(result));
  find(id).add(action, std::move(after), keeps_undone);
  drop_past();
  return *object(id).result;
}

template <int Dim>
const Result<Dim>& Segmentation<Dim>::step(Id id, int n_steps, const ProgressOf<Dim>& progress,
                                           const std::stop_token& stop) {
  if (!is_ready(id, progress, stop)) return *object(id).result;  // none of its steps
  int n_done = 0;
  return evolve(
      id,
      [&](const std::string& stage, const flow::StepRecord& record, const auto& shape) {
        n_done += record.k > 0 && record.n_elements > 0;
        return (!progress || progress(stage, record, shape)) && n_done < n_steps;
      },
      stop);
}

template <int Dim>
bool Segmentation<Dim>::is_outdated(Id id) const {
  const Outcome outcome = object(id).state();
  return object(id).is_made() && has_shape(outcome) && outcome != Outcome::kProposed &&
         awaits_evolution<Dim>(history(id)) &&
         !find(id).is_at_rest(others_of(id), setting().extent());
}

template <int Dim>
Measures<Dim> Segmentation<Dim>::measures(Id id) const {
  return setting().measures(object(id).result->shape);
}

template class Segmentation<2>;
template class Segmentation<3>;

}  // namespace surf::segment
