#include "tools/studio/dialogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/log.h"
#include "libsurf/segment/recipe.h"
#include "tools/common/field_names.h"
#include "tools/common/heap.h"
#include "tools/studio/folder.h"

namespace surfseg::studio {
namespace {

using surf::segment::Action;
using surf::segment::AddClick;
using surf::segment::Choose;
using surf::segment::Evolve;
using surf::segment::Propose;
using surf::segment::Recolour;
using surf::segment::Rename;
using surf::segment::SetOptions;
using surf::segment::TakeBackClick;

constexpr std::chrono::milliseconds kBetweenFrames(200);
constexpr const char* kMove = "moved click";

std::string words_of(const Action<3>& action) {
  struct Words {
    std::string operator()(const AddClick<3>& a) const {
      return a.click.side == Side::kInside ? "inside click" : "outside click";
    }
    std::string operator()(const TakeBackClick&) const { return "deleted click"; }
    std::string operator()(const SetOptions<3>&) const { return "options"; }
    std::string operator()(const Propose<3>&) const { return "proposals"; }
    std::string operator()(const Choose&) const { return "choice"; }
    std::string operator()(const Evolve<3>&) const { return "evolution"; }
    std::string operator()(const Rename&) const { return "name"; }
    std::string operator()(const Recolour&) const { return "colour"; }
  };
  return std::visit(Words{}, action);
}

/// Milliseconds since 1970. Errors and volumes are counted from there, so that a page that outlives
/// a program takes none of the next one for one that it knows.
std::int64_t first_number() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

std::shared_ptr<const State> first_state(std::int64_t error_number) {
  auto out = std::make_shared<State>();
  out->error_number = error_number;
  return out;
}

}  // namespace

std::string text_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error)
             ? "out of memory: close what is not needed, or use a larger edge length"
             : error.what();
}

void warn_of(const std::exception& error) noexcept {
  try {
    surf::log(surf::LogLevel::kWarning, text_of(error));
  } catch (const std::exception&) {  // no memory for that either
  }
}

bool is_move(const Action<3>* first, const Action<3>* second) {
  return first && second && std::holds_alternative<TakeBackClick>(*first) &&
         std::holds_alternative<AddClick<3>>(*second);
}

Dialogue::Dialogue(std::filesystem::path folder)
    : folder_(std::move(folder)),
      last_opened_(first_number()),
      state_(first_state(last_opened_)),
      worker_([this] { work(); }) {}

Dialogue::~Dialogue() {
  {
    std::lock_guard lock(mutex_);
    is_ending_ = true;
    stop_.request_stop();
  }
  wake_.notify_all();
  changed_.notify_all();
  worker_.join();
}

void Dialogue::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] {
      return is_ending_ || !acts_.empty() || !wanted_.empty() || opening_.has_value();
    });
    if (is_ending_ && acts_.empty()) return;
    try {
      do_next(lock);
    } catch (const std::exception& error) {
      if (lock.owns_lock()) lock.unlock();
      outlive(error);
    }
    lock.lock();
  }
}

/// @param lock  unlocked while it works, and after it
void Dialogue::do_next(std::unique_lock<std::mutex>& lock) {
  stop_ = {};
  is_kept_ = false;
  if (is_act_next()) {
    const Act act = std::move(acts_.front().act);
    acts_.pop_front();
    lock.unlock();
    act();
  } else if (opening_) {
    const auto opening = std::move(*opening_);
    opening_.reset();
    lock.unlock();
    opening();
  } else {
    const Wanted wanted = wanted_.front();
    lock.unlock();
    try {
      run(wanted);
    } catch (...) {
      unwant(wanted.id);  // or it might fail without end
      throw;
    }
  }
}

/// What was done could not be checked, kept or told, most likely for want of memory. The page sees
/// the state before it, with the error and without a job, if there is memory for that.
void Dialogue::outlive(const std::exception& error) noexcept {
  warn_of(error);
  try {
    std::lock_guard lock(mutex_);
    job_.reset();
    frame_.reset();
    auto next = state_with_error(text_of(error));
    ++next->revision;
    next->job = present_job();
    state_ = std::move(next);
    ++tick_;
  } catch (const std::exception&) {
  }
  changed_.notify_all();
}

/// Under the lock. What only changes how objects look waits for the evolution that is next in turn:
/// done before, it would stand between a click and what the click set off, and undoing it would
/// take the surface with it.
bool Dialogue::is_act_next() const {
  if (acts_.empty() || is_ending_ || opening_ || wanted_.empty()) return !acts_.empty();
  return std::any_of(acts_.begin(), acts_.end(), [](const Waiting& w) { return !w.show; });
}

/// On the worker, before anything else is computed.
/// @param while_opening  may end what is being opened
void Dialogue::do_now(const Act& act, bool while_opening) {
  std::promise<void> done;
  std::exception_ptr failure;  // the caller's alone once it is told: the worker holds it no more
  {
    std::lock_guard lock(mutex_);
    if (is_ending_) throw surf::UsageError("the studio is ending");
    if (job_ && job_->what == "open" && !while_opening)
      throw surf::UsageError("the volume is being opened: wait until it is there");
    acts_.push_back({[&] {
                       try {
                         act();
                       } catch (...) {
                         failure = std::current_exception();
                       }
                       done.set_value();
                     },
                     {}});
    stop_.request_stop();
  }
  wake_.notify_all();
  done.get_future().get();
  if (failure) std::rethrow_exception(failure);
}

surf::segment::Segmentation<3>& Dialogue::segmentation() {
  if (!segmentation_) throw surf::UsageError("no volume is open");
  return *segmentation_;
}

/// What only changes how objects look ends no evolution.
/// @param show_now  changes the state that is seen; throws if it cannot be
void Dialogue::do_beside(const Act& act, const std::function<void(State&)>& show_now) {
  {
    std::lock_guard lock(mutex_);
    // Also where the evolution is next in turn but has not begun: it would be ended at once.
    if (!is_ending_ && (job_ ? job_->what != "open" : !wanted_.empty())) {
      auto next = std::make_shared<State>(*state_);
      show_now(*next);
      ++next->revision;
      state_ = std::move(next);
      acts_.push_back({[this, act] {
                         try {
                           act();
                         } catch (const std::exception& error) {
                           publish_error(text_of(error));
                         }
                       },
                       show_now});
      ++tick_;
      wake_.notify_all();
      changed_.notify_all();
      return;
    }
  }
  do_now(act);
}

/// The object evolves next.
void Dialogue::want(int id) {
  unwant(id);
  std::lock_guard lock(mutex_);
  wanted_.push_front({id, true});
}

/// Next, its result is made again if it has been dropped.
void Dialogue::want_made(int id) {
  unwant(id);
  if (segmentation_->is_made(id)) return;
  std::lock_guard lock(mutex_);
  wanted_.push_front({id, false});
}

void Dialogue::unwant(int id) {
  std::lock_guard lock(mutex_);
  std::erase_if(wanted_, [id](const Wanted& wanted) { return wanted.id == id; });
}

bool Dialogue::can_evolve(int id) const {
  const auto objects = segmentation_ ? segmentation_->objects() : std::vector<int>();
  if (std::find(objects.begin(), objects.end(), id) == objects.end()) return false;
  const auto clicks = segmentation_->object(id).clicks;
  return std::any_of(clicks.begin(), clicks.end(),
                     [](const auto& click) { return click.side == Side::kInside; });
}

/// What the present state of the history asks for.
void Dialogue::want_present(int id) {
  if (awaits_evolution(id))
    want(id);
  else
    want_made(id);
}

/// Whether it was left with a click, or whatever else, that no evolution has heeded.
bool Dialogue::awaits_evolution(int id) const {
  return surf::segment::awaits_evolution<3>(segmentation_->history(id)) && can_evolve(id);
}

/// What has been dropped is made again first.
void Dialogue::run(const Wanted& wanted) {
  const int id = wanted.id;
  const auto objects = segmentation_ ? segmentation_->objects() : std::vector<int>();
  const bool is_there = std::find(objects.begin(), objects.end(), id) != objects.end();
  const bool is_made = is_there && segmentation_->is_made(id);
  if (!is_there || (is_made && !(wanted.evolves && can_evolve(id)))) {
    unwant(id);
    return publish();
  }
  std::string error;
  bool is_done = true;
  try {
    begin_job(id, is_made ? "evolve" : "repeat");
    is_done = is_made ? evolve_now(id) : make_now(id);
  } catch (const std::exception& exception) {
    error = text_of(exception);
  }
  {
    std::lock_guard lock(mutex_);
    if (!is_done && !is_kept_)
      wanted_.push_back(wanted);
    else if (is_done && !is_made && wanted.evolves && error.empty() && !is_kept_)
      wanted_.push_front(wanted);
  }
  end_job();
  if (is_made && is_done) save();
  if (error.empty())
    publish();
  else
    publish_error(error);
}

/// False if something newer ended it; then there is no trace of it.
bool Dialogue::evolve_now(int id) {
  const auto n_before = segmentation_->history(id).size();
  segmentation_->evolve(
      id, frames(), stop_.get_token(),
      [this] {
        std::lock_guard lock(mutex_);
        return is_kept_;
      },
      true);
  return segmentation_->history(id).size() > n_before;
}

bool Dialogue::make_now(int id) {
  segmentation_->make(id, frames(), stop_.get_token());
  return segmentation_->is_made(id);
}

void Dialogue::begin_job(int object, const std::string& what, const std::string& stage) {
  {
    std::lock_guard lock(mutex_);
    Job job;
    job.number = ++n_jobs_;
    job.object = object;
    job.what = what;
    job.stage = stage;
    job_ = job;
    std::erase_if(wanted_, [object](const Wanted& wanted) { return wanted.id == object; });
    frame_.reset();
    job_begin_ = std::chrono::steady_clock::now();
    last_frame_ = {};
  }
  publish();
}

/// What waited for its end is done first, so that without a job nothing waits; but for an evolution
/// that is next again, whose end it waits for, see is_act_next().
void Dialogue::end_job() {
  {
    std::unique_lock lock(mutex_);
    const bool is_next_again = job_ && std::any_of(wanted_.begin(), wanted_.end(),
                                                   [&](const auto& w) { return w.evolves; });
    while (!is_next_again && !acts_.empty() && acts_.front().show) {
      const Act act = std::move(acts_.front().act);
      acts_.pop_front();
      lock.unlock();
      act();
      lock.lock();
    }
    // It is in the state until the next one is published.
    if (job_) ended_job_ = present_job();
    job_.reset();
    frame_.reset();
  }
  give_freed_memory_back();  // a studio runs for hours
}

/// After every step; makes a frame now and then.
bool Dialogue::show(const std::string& stage, const surf::flow::StepRecord& record,
                    const std::function<surf::Triangles()>& shape) {
  const auto now = std::chrono::steady_clock::now();
  std::shared_ptr<const surf::Triangles> frame;
  if (now - last_frame_ >= kBetweenFrames) {
    frame = std::make_shared<surf::Triangles>(shape());
    if (frame->elements.rows() == 0)
      frame.reset();  // while regions are looked for
    else
      last_frame_ = now;
  }
  {
    std::lock_guard lock(mutex_);
    if (!job_) return true;
    job_->stage = stage;
    job_->step = record.k;
    if (frame) {
      frame_ = std::move(frame);
      ++job_->frame;
    }
    ++tick_;
  }
  changed_.notify_all();
  return true;
}

surf::segment::ProgressOf<3> Dialogue::frames() {
  return [this](const auto& stage, const auto& record, const auto& shape) {
    return show(stage, record, shape);
  };
}

/// Under the lock. An evolution that is next in turn counts as one, so that nobody takes the moment
/// before it for the end.
std::optional<Job> Dialogue::present_job() const {
  if (job_) {
    Job job = *job_;
    job.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - job_begin_).count();
    return job;
  }
  if (wanted_.empty()) return std::nullopt;
  Job job;
  job.number = n_jobs_ + 1;
  job.object = wanted_.front().id;
  job.what = "evolve";
  return job;
}

/// What undo would take back; "" if there is nothing.
std::string Dialogue::undo_words(int id) const {
  if (undo_brings_back(id)) return "removal of " + removed_.back().name;
  const auto history = segmentation_->history(id);
  const auto act =
      std::find_if_not(history.rbegin(), history.rend(), surf::segment::is_consequence<3>);
  if (act == history.rend()) return "";
  return act + 1 != history.rend() && is_move(&act[1], &act[0]) ? kMove : words_of(*act);
}

/// What redo would do again; "" if there is nothing.
std::string Dialogue::redo_words(int id) const {
  if (redo_removes(id)) return "removal of " + brought_back_.back().name;
  const Action<3>* undone = segmentation_->undone(id);
  if (is_move(undone, segmentation_->undone(id, 1))) return kMove;
  return undone ? words_of(*undone) : "";
}

void Dialogue::publish() {
  auto next = std::make_shared<State>();
  next->volume = volume_;
  next->series_of = series_of_;
  if (segmentation_) {
    decltype(checked_) checked;
    for (const int id : segmentation_->objects()) {
      ObjectState object;
      object.id = id;
      object.object = segmentation_->object(id);
      const auto& result = object.object.result;
      if (surf::segment::has_shape(result->outcome) && result->shape.elements.rows() > 0) {
        Checked& known = checked_[result];
        if (!known.measures)
          known = {std::make_shared<const surf::segment::Measures<3>>(segmentation_->measures(id)),
                   ++n_surfaces_};
        checked[result] = known;
        object.measures = known.measures;
        object.surface = known.surface;
      }
      object.undo_words = undo_words(id);
      object.can_undo = !object.undo_words.empty();
      object.is_outdated = segmentation_->is_outdated(id);
      object.redo_words = redo_words(id);
      object.can_redo = !object.redo_words.empty();
      next->objects.push_back(std::move(object));
    }
    checked_ = std::move(checked);
    if (!removed_.empty()) next->removed = removed_.back().name;
  }
  {
    std::lock_guard lock(mutex_);
    next->revision = state_->revision + 1;
    next->error_number = state_->error_number;
    next->error = state_->error;
    next->job = present_job();
    for (const Waiting& waiting : acts_) {
      if (!waiting.show) continue;
      try {
        waiting.show(*next);
      } catch (const surf::UsageError&) {  // it will say so itself
      }
    }
    state_ = std::move(next);
    ++tick_;
  }
  changed_.notify_all();
}

/// In the page and on the terminal.
void Dialogue::publish_error(const std::string& text) {
  surf::log(surf::LogLevel::kWarning, text);
  {
    std::lock_guard lock(mutex_);
    state_ = state_with_error(text);
  }
  publish();
}

/// Under the lock. The state that is seen, but for the error.
std::shared_ptr<State> Dialogue::state_with_error(const std::string& text) const {
  auto out = std::make_shared<State>(*state_);
  out->error = with_option_names(text, "surfseg");
  std::replace(out->error.begin(), out->error.end(), '\n', ' ');
  ++out->error_number;
  return out;
}

std::string Dialogue::recipe_now() const {
  return surf::segment::to_recipe<3>(*segmentation_, volume_->name,
                                     volume_->series_uid.value_or(""));
}

/// Beside the scan, whole or not at all.
void Dialogue::save() {
  const std::string text = recipe_now();
  {
    std::lock_guard lock(mutex_);
    recipe_ = text;
  }
  try {
    if (leads_out(folder_, volume_->recipe))
      throw surf::OutputError(fmt::format("{} is a link that leads out of the folder: remove it",
                                          volume_->recipe.filename().string()));
    spare_what_others_keep();
    surf::write_bytes(volume_->recipe.string(), text);
    kept_ = text;
  } catch (const surf::OutputError& error) {
    publish_error(fmt::format("the state is not kept: {}", error.what()));
  }
}

std::shared_ptr<const State> Dialogue::state() const {
  std::lock_guard lock(mutex_);
  return state_;
}

std::optional<Job> Dialogue::job() const {
  std::lock_guard lock(mutex_);
  return present_job();
}

std::optional<Job> Dialogue::job_of(const State& state) const {
  if (!state.job) return std::nullopt;
  std::lock_guard lock(mutex_);
  for (const auto& job : {present_job(), ended_job_})
    if (job && job->number == state.job->number) return job;
  return state.job;
}

std::shared_ptr<const surf::Triangles> Dialogue::surface(int id, int* frame) const {
  std::lock_guard lock(mutex_);
  if (frame) *frame = 0;
  if (job_ && job_->object == id && frame_) {
    if (frame) *frame = job_->frame;
    return frame_;
  }
  for (const ObjectState& object : state_->objects)
    if (object.id == id && object.measures)
      return {object.object.result, &object.object.result->shape};
  return nullptr;
}

/// Of a volume that has just been opened it is about to be there.
std::string Dialogue::recipe() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !state_->volume || !recipe_.empty() || is_ending_; });
  if (recipe_.empty()) throw surf::UsageError("no volume is open");
  return recipe_;
}

void Dialogue::wait_for_change(std::uint64_t revision, std::uint64_t tick,
                               std::chrono::milliseconds at_most) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, at_most,
                    [&] { return is_ending_ || state_->revision != revision || tick_ != tick; });
}

}  // namespace surfseg::studio
