// What has been done to one object, step by step.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "libsurf/segment/action.h"
#include "libsurf/segment/result.h"

namespace surf::segment {

/// Stands for a result that has been dropped, or not been made yet: a state of kEmpty with a
/// message that says so.
template <int Dim>
const std::shared_ptr<const Result<Dim>>& result_to_be_made();

/// Of its shapes and of what its last click has found.
template <int Dim>
std::size_t memory_bytes(const Result<Dim>& result);

/// An object at one moment.
template <int Dim>
struct Object {
  std::string name;
  Colour colour = {};
  std::vector<Click<Dim>> clicks;  ///< in the order in which they were made
  Options<Dim> options;            ///< its seeds_mm and outside_mm are not used: the clicks are
  /// Proposals, shape and state; never null. Shared by the moments that do not change it.
  std::shared_ptr<const Result<Dim>> result;

  Outcome state() const { return result->outcome; }
  bool is_made() const { return result != result_to_be_made<Dim>(); }
};

/// The moments of an object; those behind n_done have been undone.
template <int Dim>
struct History {
  struct Moment {
    Action<Dim> action;
    Object<Dim> after;
    bool is_between = false;  ///< what was undone before it goes on from the moment before
  };

  Object<Dim> first;  ///< as it was added
  std::vector<Moment> moments;
  std::size_t n_done = 0;

  const Object<Dim>& now() const { return n_done == 0 ? first : moments[n_done - 1].after; }
  bool undo() { return n_done > 0 && n_done-- > 0; }
  bool can_redo() const { return n_done < moments.size(); }
  bool redo() {
    if (!can_redo()) return false;
    while (n_done > 0 && moments[n_done - 1].is_between)
      moments.erase(moments.begin() + std::ptrdiff_t(--n_done));
    ++n_done;
    return true;
  }
  /// What redo() would do again; null if there is nothing.
  /// @param n  the n-th of them
  const Action<Dim>* undone(std::size_t n = 0) const {
    return n_done + n < moments.size() ? &moments[n_done + n].action : nullptr;
  }
  /// What has been done and is not undone.
  std::vector<Action<Dim>> actions() const {
    std::vector<Action<Dim>> out;
    for (std::size_t n = 0; n < n_done; ++n) out.push_back(moments[n].action);
    return out;
  }
  /// Whether the shape has come to rest, and nothing has been done since then but to click where
  /// it obeys already.
  /// @param others  inside clicks of other objects, as outside clicks
  bool is_at_rest(const std::vector<Click<Dim>>& others, const ImageExtent<Dim>& extent) const;
  /// What an evolution has come to rest at, if nothing has been done since then but to click, to
  /// propose, to choose and to stop another before its first step; else null. @pre  has_settled()
  std::shared_ptr<const Result<Dim>> settled() const;
  /// Whether the result of settled() is there, if there is one.
  bool has_settled() const { return has_settled(n_done); }
  /// What an evolution had reached when it was stopped or came to a limit, if nothing has been done
  /// since then but to click, and to set options that its energy does not depend on; else null.
  std::shared_ptr<const Result<Dim>> unfinished() const;
  /// Whether a click by which the present shape has evolved is not among these. Of what was
  /// proposed since then its search knows.
  /// @param clicks  of the object, and inside clicks of others as outside clicks
  bool has_lost_click(const std::vector<Click<Dim>>& clicks) const;
  /// How many moments there are before the first action that has to be repeated to make the present
  /// result, and settled(): up to one where both are there, or before an evolution that needs none.
  std::size_t n_before_repeated() const;
  /// The last evolution among the first n moments that came to its first step, if settled() may be
  /// its result; else null.
  const Moment* last_evolution(std::size_t n) const;
  bool has_settled(std::size_t n) const {
    const Moment* moment = last_evolution(n);
    return !moment || moment->after.is_made();
  }
  /// What has been undone is gone, or is kept: then redo() takes away what was added first.
  void add(Action<Dim> action, Object<Dim> after, bool keeps_undone = false) {
    const bool is_between = keeps_undone && can_redo();
    if (!is_between) {
      moments.resize(n_done);
      for (std::size_t n = n_done; n-- > 0 && moments[n].is_between;) moments[n].is_between = false;
    }
    moments.insert(moments.begin() + std::ptrdiff_t(n_done),
                   {std::move(action), std::move(after), is_between});
    ++n_done;
  }
};

}  // namespace surf::segment
