// How an object stands, in words, and the exit codes of programs.
#pragma once

#include <string>

#include "libsurf/flow/evolution.h"

namespace surf::segment {

/// Of an object, and of a stage. The state of the whole is that of the last stage that minimised
/// an energy.
enum class Outcome {
  kEmpty,      ///< nothing has been asked for yet
  kProposed,   ///< a start, not a result
  kConverged,  ///< at rest in a minimum of the stated energy
  kAtLimit,    ///< stopped at a limit, such as the number of steps: the shape so far
  kStopped,    ///< stopped on request: the shape so far
  kNoObject,   ///< no object stands out round the clicks: no shape
  kVanished    ///< the object shrank to nothing: no shape
};

/// "converged", "stopped at a limit", "no object", ...
std::string to_string(Outcome outcome);

/// What a program ends with: 0 for kProposed and kConverged, 5 for kAtLimit, 8 for kNoObject and
/// kVanished; 130 for kStopped, unless a signal says otherwise.
int exit_code(Outcome outcome);

/// Whether there is a shape to write.
bool has_shape(Outcome outcome);

/// Of a flow that has ended, but for a shape that has vanished: kConverged where no step decreases
/// the energy any further, too.
Outcome outcome_of(flow::Termination termination);

}  // namespace surf::segment
