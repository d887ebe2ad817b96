// One open volume and the dialogue about it, on a thread of its own: what the studio's page sees
// and asks for, without HTTP.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/segment/segmentation.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/volume.h"

namespace surfseg::studio {

using surf::Vector;
using surf::segment::Click;
using surf::segment::Options;
using surf::segment::Side;

/// A volume that is open.
struct OpenVolume {
  std::int64_t number = 0;  ///< grows with every opening, from one program to the next, too
  std::string name;         ///< of its file or folder in the studio's folder
  std::optional<std::string> series_uid;  ///< of the folder, if one was chosen
  surf::volume::Volume volume;
  std::shared_ptr<const surf::segment::Setting<3>> setting;
  std::filesystem::path recipe;  ///< where the state is kept
  std::vector<std::string> notes;
};

/// An object as it was at one moment.
struct ObjectState {
  int id = 0;
  surf::segment::Object<3> object;
  /// The final check of its surface; null if it has none.
  std::shared_ptr<const surf::segment::Measures<3>> measures;
  int surface = 0;           ///< another number for another surface; 0 if it has none
  bool is_outdated = false;  ///< the surface does not heed what was done last
  bool can_undo = false, can_redo = false;
  std::string undo_words;  ///< what undo would take back: "inside click"
  std::string redo_words;  ///< what redo would do again
};

/// What is being computed.
struct Job {
  int number = 0;  ///< grows with every job
  int object = 0;  ///< 0 = none
  std::string what, stage;
  int step = 0;
  double seconds = 0;
  int frame = 0;  ///< of the surface so far, grows; 0 = none yet
};

/// Everything at one moment, never changed once it is published.
struct State {
  std::uint64_t revision = 0;
  std::shared_ptr<const OpenVolume> volume;
  /// Of each folder that was to be opened and holds several, by its name.
  std::map<std::string, std::vector<surf::volume::DicomSeries>> series_of;
  std::vector<ObjectState> objects;
  std::string removed;  ///< the name of what was removed last and undo can bring back; else ""
  std::optional<Job> job;
  std::int64_t error_number = 0;  ///< grows with every error, from one program to the next, too
  std::string error;              ///< the last one: one line
};

/// A click is not the one that was meant: whoever asked had seen an older state.
class ClickChanged : public surf::UsageError {
 public:
  using UsageError::UsageError;
};

/// One line for a person.
std::string text_of(const std::exception& error);
/// That line on the terminal.
void warn_of(const std::exception& error) noexcept;

/// How much memory the results of the past may take: the more, the larger the volume is.
std::size_t max_past_bytes(const surf::volume::Volume& volume);

/// Of a click: it was taken back and added elsewhere. Either may be null.
bool is_move(const surf::segment::Action<3>* first, const surf::segment::Action<3>* second);

/// Requests may come from any thread; they are done in their order on the dialogue's own, and
/// return when they have been accepted, not when what they set off has been computed. One that
/// changes an object ends what is being computed for it: the newest counts.
class Dialogue {
 public:
  /// @param folder  nothing outside of it is read or written
  explicit Dialogue(std::filesystem::path folder);
  ~Dialogue();
  Dialogue(const Dialogue&) = delete;
  Dialogue& operator=(const Dialogue&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

  /// Reads a volume, and the recipe beside it if there is one; or a recipe and the volume that it
  /// belongs to. Then the surfaces are made again, one after the other. Errors are in the state.
  /// @param path  in the folder, or as given on the command line
  void open(const std::filesystem::path& path, const std::optional<std::string>& series_uid = {});
  void close();

  // @throws surf::UsageError  there is no volume or no such object, or what Segmentation says
  int add_object(const std::string& name);
  /// undo() brings it back, as long as the volume is open.
  void remove_object(int id);
  /// Both end nothing: while something is computed they are shown at once, and done after it.
  void rename(int id, const std::string& name);
  void recolour(int id, const surf::segment::Colour& colour);
  void click(int id, const Vector<3>& point_mm, Side side);
  /// @param was_mm  where the click is that is meant
  /// @throws ClickChanged  the one of this index is not there
  void move_click(int id, std::size_t index, const Vector<3>& point_mm,
                  const std::optional<Vector<3>>& was_mm = {});
  void delete_click(int id, std::size_t index, const std::optional<Vector<3>>& was_mm = {});
  void choose(int id, std::size_t proposal);
  /// @param change  of the object's present options
  void set_options(int id, const std::function<void(Options<3>&)>& change);
  void evolve(int id);
  /// Ends what is being computed; the surface so far stays. Nothing evolves after it; results that
  /// wait to be made again are made.
  void stop();
  /// One act of a person: a click, a change of options, a choice, with what it set off; or the
  /// removal of another object, if nothing has been done to this one since. Nothing if there is
  /// none.
  /// @param id  0 = no object: the last removal
  void undo(int id);
  /// What undo() took back last, as long as nothing else has been done since.
  void redo(int id);

  std::shared_ptr<const State> state() const;
  /// The job as it is now, also one that is about to begin; none if nothing is computed.
  std::optional<Job> job() const;
  /// The job of a state as it is now, or was at its end; none if the state has none.
  std::optional<Job> job_of(const State& state) const;
  /// The surface of this moment, also while it evolves; null if there is none.
  std::shared_ptr<const surf::Triangles> surface(int id, int* frame = nullptr) const;
  /// What repeats it all: JSON text.
  /// @throws surf::UsageError  no volume is open
  std::string recipe() const;
  /// Returns when the state or the job is another one than these, or after a while.
  void wait_for_change(std::uint64_t revision, std::uint64_t tick,
                       std::chrono::milliseconds at_most) const;
  std::uint64_t tick() const { return tick_; }

 private:
  using Act = std::function<void()>;

  /// What was asked for and is not done yet.
  struct Waiting {
    Act act;
    std::function<void(State&)> show;  ///< of what ends no evolution: what is seen of it till then
  };

  /// An object that is to be computed.
  struct Wanted {
    int id;
    bool evolves;  ///< else only its result is made again
  };

  void work();
  void do_next(std::unique_lock<std::mutex>& lock);
  void outlive(const std::exception& error) noexcept;
  bool is_act_next() const;
  void do_now(const Act& act, bool while_opening = false);
  void do_beside(const Act& act, const std::function<void(State&)>& show_now);
  surf::volume::Volume volume_of(const std::filesystem::path& image,
                                 const std::optional<std::string>& series_uid);
  void read_volume(const std::filesystem::path& path, const std::optional<std::string>& series_uid);
  void load_recipe(const std::filesystem::path& recipe);
  void forget_volume();
  void spare_what_others_keep();
  std::string recipe_now() const;
  bool can_evolve(int id) const;
  bool awaits_evolution(int id) const;
  void want_present(int id);
  void run(const Wanted& wanted);
  bool evolve_now(int id);
  bool make_now(int id);
  void begin_job(int object, const std::string& what, const std::string& stage = {});
  void end_job();
  bool show(const std::string& stage, const surf::flow::StepRecord& record,
            const std::function<surf::Triangles()>& shape);
  surf::segment::ProgressOf<3> frames();
  std::optional<Job> present_job() const;
  void publish();
  void publish_error(const std::string& text);
  std::shared_ptr<State> state_with_error(const std::string& text) const;
  void save();
  surf::segment::Segmentation<3>& segmentation();
  void check_click(int id, std::size_t index, const std::optional<Vector<3>>& was_mm);
  void want(int id);
  void want_made(int id);
  void unwant(int id);
  std::size_t n_acts(int id) const;
  void drop_evolutions();
  bool undo_brings_back(int id) const;
  bool redo_removes(int id) const;
  void bring_back();
  bool redo_act(int id);
  void set_aside(int id);
  void keep_act();
  std::string undo_words(int id) const, redo_words(int id) const;

  const std::filesystem::path folder_;

  // Of the worker alone.
  std::shared_ptr<const OpenVolume> volume_;
  std::optional<std::string> kept_;  ///< what its recipe held when it was last read or written
  std::unique_ptr<surf::segment::Segmentation<3>> segmentation_;
  struct Checked {
    std::shared_ptr<const surf::segment::Measures<3>> measures;
    int surface = 0;
  };
  /// Of the objects' present results.
  std::map<std::shared_ptr<const surf::segment::Result<3>>, Checked> checked_;
  int n_surfaces_ = 0;
  struct Removed {
    int id;
    std::string name;
    std::map<int, std::size_t> n_acts_of;  ///< of the objects, when it was removed
    std::size_t n_acts(int other) const {
      const auto known = n_acts_of.find(other);
      return known == n_acts_of.end() ? 0 : known->second;
    }
  };
  std::vector<Removed> removed_, brought_back_;  ///< what undo and redo take next at the end
  std::map<std::string, std::vector<surf::volume::DicomSeries>> series_of_;
  std::int64_t last_opened_;  ///< its number

  mutable std::mutex mutex_;
  mutable std::condition_variable wake_, changed_;
  std::deque<Waiting> acts_;
  std::deque<Wanted> wanted_;  ///< the next one first
  std::optional<std::function<void()>> opening_;
  std::shared_ptr<const State> state_;
  std::optional<Job> job_, ended_job_;
  int n_jobs_ = 0;
  std::shared_ptr<const surf::Triangles> frame_;
  std::chrono::steady_clock::time_point job_begin_, last_frame_;
  std::string recipe_;
  bool is_kept_ = false;  ///< what is being computed stays when it is ended
  bool is_ending_ = false;
  std::stop_source stop_;
  std::atomic<std::uint64_t> tick_ = 0;
  std::thread worker_;
};

}  // namespace surfseg::studio
