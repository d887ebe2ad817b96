// What a person may ask of the dialogue: each is done on its thread, before anything else.
#include <fmt/format.h>

#include <algorithm>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "tools/common/objects.h"
#include "tools/studio/dialogue.h"

namespace surfseg::studio {

using surf::segment::Action;

namespace {

ObjectState& find(State& state, int id) {
  for (ObjectState& object : state.objects)
    if (object.id == id) return object;
  throw surf::UsageError(fmt::format("there is no object {}", id));
}

bool is_made(const State& state, int id) {
  return std::any_of(state.objects.begin(), state.objects.end(), [id](const ObjectState& object) {
    return object.id == id && object.object.is_made();
  });
}

/// Exports and `surfseg replay` name files after objects.
void check_is_name_of_a_file(const std::string& name) {
  if (!is_fit_for_a_file(name))
    throw surf::UsageError(
        fmt::format("name: expected one that a file can have; got '{}'", surf::one_line(name)));
}

}  // namespace

/// After an act of a person: what was undone before it cannot be done again.
void Dialogue::keep_act() {
  brought_back_.clear();
  save();
  publish();
}

int Dialogue::add_object(const std::string& name) {
  if (!name.empty()) check_is_name_of_a_file(name);
  int id = 0;
  do_now([&] {
    id = segmentation().add_object(name);
    keep_act();
  });
  return id;
}

void Dialogue::remove_object(int id) {
  do_now([&] {
    set_aside(id);
    keep_act();
  });
}

void Dialogue::rename(int id, const std::string& name) {
  if (name.empty()) throw surf::UsageError("the name is empty");
  check_is_name_of_a_file(name);
  const auto act = [this, id, name] {
    segmentation().rename(id, name);
    keep_act();
  };
  do_beside(act, [id, name](State& state) {
    for (const ObjectState& other : state.objects)
      if (other.id != id && other.object.name == name)
        throw surf::UsageError(fmt::format("there is an object '{}' already", name));
    find(state, id).object.name = name;
  });
}

void Dialogue::recolour(int id, const surf::segment::Colour& colour) {
  const auto act = [this, id, colour] {
    segmentation().recolour(id, colour);
    keep_act();
  };
  do_beside(act, [id, colour](State& state) { find(state, id).object.colour = colour; });
}

void Dialogue::click(int id, const Vector<3>& point_mm, Side side) {
  do_now([&] {
    segmentation().add_click(id, {point_mm, side});
    want(id);
    keep_act();
  });
}

/// Indices change with every click that is moved or deleted.
void Dialogue::check_click(int id, std::size_t index, const std::optional<Vector<3>>& was_mm) {
  if (!was_mm) return;
  const auto clicks = segmentation().object(id).clicks;
  if (index >= clicks.size() || clicks[index].point_mm != *was_mm)
    throw ClickChanged(
        "the click is not where it was, by what was done meanwhile: nothing was changed");
}

void Dialogue::move_click(int id, std::size_t index, const Vector<3>& point_mm,
                          const std::optional<Vector<3>>& was_mm) {
  do_now([&] {
    check_click(id, index, was_mm);
    segmentation().move_click(id, index, point_mm);
    want(id);
    keep_act();
  });
}

void Dialogue::delete_click(int id, std::size_t index, const std::optional<Vector<3>>& was_mm) {
  do_now([&] {
    check_click(id, index, was_mm);
    segmentation().take_back_click(id, index);
    if (!segmentation().object(id).clicks.empty()) want(id);
    keep_act();
  });
}

void Dialogue::choose(int id, std::size_t proposal) {
  do_now([&] {
    if (const std::size_t n = segmentation().object(id).result->proposals.size(); proposal >= n)
      throw surf::UsageError(
          fmt::format("number: there is no candidate {}; there are {}", proposal + 1, n));
    segmentation().choose(id, proposal);
    want(id);
    keep_act();
  });
}

void Dialogue::set_options(int id, const std::function<void(Options<3>&)>& change) {
  do_now([&] {
    Options<3> options = segmentation().object(id).options;
    change(options);
    segmentation().set_options(id, options);
    if (!segmentation().object(id).clicks.empty()) want(id);
    keep_act();
  });
}

void Dialogue::evolve(int id) {
  do_now([&] {
    segmentation().object(id);
    want(id);
    publish();
  });
}

/// Under the lock. What waits to be made again is made all the same: nothing else would ask for it.
void Dialogue::drop_evolutions() {
  std::erase_if(wanted_, [&](const Wanted& wanted) { return is_made(*state_, wanted.id); });
  for (Wanted& wanted : wanted_) wanted.evolves = false;
}

void Dialogue::stop() {
  {
    std::lock_guard lock(mutex_);
    is_kept_ = true;
    drop_evolutions();
    acts_.push_back({[this] {
                       {
                         std::lock_guard its(mutex_);
                         drop_evolutions();  // that acts before this one have asked for
                       }
                       publish();
                     },
                     {}});
    stop_.request_stop();
  }
  wake_.notify_all();
}

/// What a person has done to the object and not undone.
std::size_t Dialogue::n_acts(int id) const {
  const auto history = segmentation_->history(id);
  return history.size() - std::size_t(std::count_if(history.begin(), history.end(),
                                                    surf::segment::is_consequence<3>));
}

/// Rather than take back the last act on this object.
bool Dialogue::undo_brings_back(int id) const {
  if (id == 0 || removed_.empty()) return !removed_.empty();
  return n_acts(id) <= removed_.back().n_acts(id);
}

/// Rather than do again what was undone of this object.
bool Dialogue::redo_removes(int id) const {
  return !brought_back_.empty() && n_acts(id) >= brought_back_.back().n_acts(id);
}

void Dialogue::set_aside(int id) {
  Removed removed{id, segmentation().object(id).name, {}};
  for (const int other : segmentation().objects()) removed.n_acts_of[other] = n_acts(other);
  segmentation().set_aside(id);
  removed_.push_back(std::move(removed));
  unwant(id);
}

void Dialogue::bring_back() {
  const int id = removed_.back().id;
  segmentation_->bring_back(id);
  brought_back_.push_back(std::move(removed_.back()));
  removed_.pop_back();
  want_present(id);
  save();
  publish();
}

void Dialogue::undo(int id) {
  do_now([&] {
    auto& s = segmentation();
    if (undo_brings_back(id)) return bring_back();
    int n_consequences = 0;
    for (; !s.history(id).empty() && surf::segment::is_consequence<3>(s.history(id).back());
         ++n_consequences)
      s.undo(id);
    const auto history = s.history(id);
    if (history.empty()) return;
    const bool was_moved =
        history.size() > 1 && is_move(&history[history.size() - 2], &history.back());
    try {
      s.undo(id);
    } catch (const surf::UsageError&) {  // its former name is another's: all stays as it was
      while (n_consequences-- > 0) s.redo(id);
      throw;
    }
    if (was_moved) s.undo(id);
    want_present(id);
    save();
    publish();
  });
}

void Dialogue::redo(int id) {
  do_now([&] {
    if (redo_removes(id)) {
      set_aside(brought_back_.back().id);
      brought_back_.pop_back();
      save();
      return publish();
    }
    if (!redo_act(id)) return;
    // What was done while the evolution of the act before it had not come to its end: that went on
    // to heed them both.
    try {
      while (awaits_evolution(id) && redo_act(id)) continue;
    } catch (const surf::UsageError&) {  // a name that is another's: an act for the next redo
    }
    want_present(id);
    save();
    publish();
  });
}

/// Does again what a person did, with what it set off; false if there is nothing.
bool Dialogue::redo_act(int id) {
  auto& s = segmentation();
  if (!s.redo(id)) return false;
  const Action<3> done = s.history(id).back();
  bool is_first = true;
  const auto belongs = [&](const Action<3>* next) {
    return next && (surf::segment::is_consequence<3>(*next) || (is_first && is_move(&done, next)));
  };
  for (; belongs(s.undone(id)); is_first = false) s.redo(id);
  return true;
}

}  // namespace surfseg::studio
