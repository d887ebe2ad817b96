// The centre of the house: one image, what has been computed from it, and the objects in it. See
// docs/developer.md for the stages behind it.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/segment/candidate.h"
#include "libsurf/segment/checkpointing.h"
#include "libsurf/segment/fields.h"
#include "libsurf/segment/history.h"

namespace surf::segment {

/// A dialogue about one image: clicks make and mend objects. Fields that are computed from the
/// image are kept for further clicks, within a bound of memory.
///
/// Everything that is done to an object is an entry of its history: it can be undone and redone,
/// and a recipe repeats it, to the byte. Results of the past may be bounded in memory: those
/// furthest from the present are dropped first, and make() makes one again that is wanted.
///
/// Objects know of each other: the inside clicks that the others have when one is proposed or
/// evolved are outside clicks to it, heeded right after its first inside click. Its own clicks come
/// after them and stay as they were made. That shapes do not overlap is seen to at the end, by
/// finish_objects().
///
/// Threads: one at a time may call any function of one segmentation; several segmentations are
/// independent. Work is done on the calling thread, helped by TBB's. Progress is called on it,
/// under no lock: it may look at anything but this segmentation. A std::stop_token that any thread
/// may use stops propose() and evolve() between two steps or windows; what has been reached is
/// kept.
template <int Dim>
class Segmentation {
 public:
  using Id = int;
  /// Of one object: nobody clicks that often, and each may cost a second of search. What is painted
  /// is a stroke (marks.h), which is one click.
  static constexpr std::size_t kMostClicks = 1000;

  /// @param setting         the image, from make_setting() or curve::make_setting()
  /// @param max_bytes       of fields that are kept though nobody uses them now
  /// @param max_past_bytes  of results; those of the present stay in any case
  explicit Segmentation(std::shared_ptr<const Setting<Dim>> setting,
                        std::size_t max_bytes = std::size_t(1) << 30,
                        std::size_t max_past_bytes = std::numeric_limits<std::size_t>::max());

  const Setting<Dim>& setting() const { return fields_.setting(); }

  /// @param name    empty = "object 1", "object 2", ..., one that no object has
  /// @param colour  none = the next of a palette
  /// @throws UsageError  another object has the name
  Id add_object(const std::string& name = {}, const std::optional<Colour>& colour = {});
  void remove_object(Id id);
  /// It is none of the objects until bring_back(), which makes it one again as it was, with its
  /// history. Meanwhile its results are those furthest from the present.
  void set_aside(Id id);
  /// @throws UsageError  it has not been set aside; another object has its name by now
  void bring_back(Id id);
  /// The object as it was added.
  const Object<Dim>& first(Id id) const { return find(id).first; }
  std::vector<Id> objects() const;  ///< in the order in which they were made
  /// Valid until the object is changed. Here and below: @throws UsageError  there is no such object
  const Object<Dim>& object(Id id) const;

  /// @throws UsageError  the point is outside the image, an inside click outside the box of the
  ///                     options, or in the same cell as a click of the other side or, if it is
  ///                     inside, as an inside click of another object; there are kMostClicks
  ///                     already
  void add_click(Id id, const Click<Dim>& click);
  /// @throws UsageError  there is no such click
  void take_back_click(Id id, std::size_t index);
  /// It is taken back and added elsewhere, on the same side: two entries, the last of the clicks.
  /// Of a stroke a point is left. Where it may not be, nothing changes, and what was undone can be
  /// redone.
  /// @throws UsageError  there is no such click, or what add_click() says of the point
  void move_click(Id id, std::size_t index, const Vector<Dim>& point_mm);
  /// @throws UsageError  options.error() is not empty, an energy or a parameter is unknown, a
  ///                     sample is outside the image, a blur is wider than it
  void set_options(Id id, const Options<Dim>& options);
  void rename(Id id, const std::string& name);
  void recolour(Id id, const Colour& colour);

  /// Makes what a first click with the standard options needs of the image, so that it is there.
  void prepare();

  /// Regions round the clicks, best first; the best one is chosen. None: the state is kNoObject.
  /// @throws UsageError  there is no inside click, or one is in a cell with that of another object
  const Result<Dim>& propose(Id id, const ProgressOf<Dim>& progress = {},
                             const std::stop_token& stop = {}) {
    return propose_beside(id, checked_others_of(id), progress, stop);
  }
  /// What was proposed, and what was besides for the clicks before the last; see candidate.h. Empty
  /// if nothing was proposed.
  std::vector<Candidate<Dim>> candidates(Id id);
  /// Its shape becomes that of the object, its state kProposed.
  /// @throws UsageError  there is no such proposal
  const Result<Dim>& choose(Id id, std::size_t proposal);
  /// Minimises the energy of the options from the present shape: a warm start; without an energy,
  /// after other options, from the region of the clicks again. Clicks are obstacles
  /// on its way, see MovingShapeOptions::held_points: the shape has them where they belong and
  /// comes no nearer to them than half a cell; notes say where it cannot. Where there is none, or a
  /// click is not heeded by it, with explicit energies from options.initial or else from balls
  /// round the inside clicks, without an energy from what is proposed or, where there is no inside
  /// click, from options.initial. After a click that was heeded has been taken back it begins anew,
  /// too. What has come to rest and obeys all clicks that were added since then stays as it is;
  /// what does not obey them evolves again, a large shape only where they change the region
  /// (amend.h). What was stopped or came to a limit goes on with the energy that it had, all of it
  /// also where a part was evolving alone, unless options that the energy depends on have changed.
  /// @param keeps_stopped  whether what a stop has left is kept; asked once it has stopped. If not,
  ///                       nothing has been done, and what was undone can be redone. None = it is
  /// @param keeps_undone  what was undone can be redone also after it has come to its end: redo()
  ///                      takes this evolution away first
  /// @throws UsageError  there is nothing to start from, or an inside click is in a cell with that
  ///                     of another object
  const Result<Dim>& evolve(Id id, const ProgressOf<Dim>& progress = {},
                            const std::stop_token& stop = {},
                            const std::function<bool()>& keeps_stopped = {},
                            bool keeps_undone = false) {
    return evolve_beside(id, checked_others_of(id), progress, stop, keeps_stopped, keeps_undone);
  }

  /// evolve() that is stopped after n_steps steps, unless it comes to its end before; the next call
  /// goes on from there.
  /// @param n_steps  rest is seen within one call: at least the window of the options' flow, or it
  ///                 goes on for ever
  const Result<Dim>& step(Id id, int n_steps, const ProgressOf<Dim>& progress = {},
                          const std::stop_token& stop = {});

  /// Of each further evolve(): where it leaves its state between the stages, and the state that it
  /// goes on from. An evolution that only finds itself at rest leaves none.
  void set_checkpointing(Checkpointing checkpointing) { checkpointing_ = std::move(checkpointing); }

  /// Takes back the last entry of the history; false if there is none. redo() repeats it, from
  /// memory. With a bound of the past's memory the result may have to be made afterwards.
  /// @throws UsageError  another object has the name by now that this one would have again
  bool undo(Id id);
  bool redo(Id id);
  bool can_redo(Id id) const { return find(id).can_redo(); }
  /// What redo() would do again; null if there is nothing. Valid until the object is changed.
  /// @param n  the n-th of them
  const Action<Dim>* undone(Id id, std::size_t n = 0) const { return find(id).undone(n); }
  /// Whether the object's result is there.
  bool is_made(Id id) const { return object(id).is_made(); }
  /// Makes it again if it is not, the same to the bit: from the nearest moment before it whose
  /// result is there, or the last evolution that began anew. propose() and evolve() do so by
  /// themselves. Nothing changes after a stop.
  const Result<Dim>& make(Id id, const ProgressOf<Dim>& progress = {},
                          const std::stop_token& stop = {});
  /// What has been done so far and is not undone.
  std::vector<Action<Dim>> history(Id id) const;
  /// Whether its shape is not what its clicks, options and choices ask for: something was done last
  /// that no evolution has heeded, and that the shape does not obey as it is.
  bool is_outdated(Id id) const;
  /// Does what an entry says.
  void apply(Id id, const Action<Dim>& action, const ProgressOf<Dim>& progress = {},
             const std::stop_token& stop = {});
  /// Adds the entry, but computes nothing: the result is left to make().
  void note(Id id, const Action<Dim>& action);

  /// The final check and the measures of the present shape.
  Measures<Dim> measures(Id id) const;
  /// Of the fields that are kept.
  std::size_t memory_bytes() const { return fields_.memory_bytes(); }

 private:
  History<Dim>& find(Id id);
  const History<Dim>& find(Id id) const;
  bool has_name(const std::string& name, Id besides) const;
  void check_name(const std::string& name, Id besides) const;
  void check_beside_others(Id id, const Click<Dim>& click) const;
  void add_click_unchecked_beside(Id id, const Click<Dim>& click);
  /// @throws UsageError  what add_click() says, but of other objects
  Object<Dim> with_click(Object<Dim> object, const Click<Dim>& click) const;
  std::vector<Click<Dim>> others_of(Id id) const;
  /// @throws UsageError  an inside click is in a cell with that of another object
  std::vector<Click<Dim>> checked_others_of(Id id) const;
  std::shared_ptr<const SearchGrid<Dim>> grid_for(const Options<Dim>& options);
  Work<Dim> work_for(const Object<Dim>& object, const std::vector<Click<Dim>>& others,
                     const ProgressOf<Dim>& progress, const std::stop_token& stop);
  const Result<Dim>& propose_beside(Id id, const std::vector<Click<Dim>>& others,
                                    const ProgressOf<Dim>& progress, const std::stop_token& stop);
  const Result<Dim>& evolve_beside(Id id, const std::vector<Click<Dim>>& others,
                                   const ProgressOf<Dim>& progress, const std::stop_token& stop,
                                   const std::function<bool()>& keeps_stopped = {},
                                   bool keeps_undone = false);
  /// @param is_anew  set: whether it went on from nothing before it
  Result<Dim> evolved(const History<Dim>& history, const std::vector<Click<Dim>>& others,
                      const ProgressOf<Dim>& progress, const std::stop_token& stop, bool& is_anew);
  bool is_ready(Id id, const ProgressOf<Dim>& progress, const std::stop_token& stop);
  bool repeat(Id id, const History<Dim>& whole, const ProgressOf<Dim>& progress,
              const std::stop_token& stop);
  void drop_past();

  Fields<Dim> fields_;
  std::size_t max_past_bytes_;
  std::map<Id, History<Dim>> objects_, aside_;
  Id next_ = 1;
  Checkpointing checkpointing_;
};

}  // namespace surf::segment
