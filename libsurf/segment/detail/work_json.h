// The state of a run between two stages as JSON, for checkpoints.
#pragma once

#include <string>

#include "libsurf/segment/stage.h"

namespace surf::segment {

/// All of the work that stages have made, but for what the search found.
/// @param n_stages  that are done, of plan()
/// @param goes_on   another one may follow
template <int Dim>
std::string state_of(const Work<Dim>& work, std::size_t n_stages, bool goes_on);

/// What a state says of the stages.
struct StagesDone {
  std::size_t n_stages = 0;
  bool goes_on = true;
  int n_steps = 0;  ///< of which progress was told
};

/// Puts into `work` what state_of() had of it.
/// @throws InputError  no such state
template <int Dim>
StagesDone restore(const std::string& state, Work<Dim>& work);

/// The same without the work.
/// @throws InputError
StagesDone stages_done(const std::string& state);

}  // namespace surf::segment
