#include "libsurf/segment/outcome.h"

#include "libsurf/base/names.h"

namespace surf::segment {

std::string to_string(Outcome outcome) {
  using enum Outcome;
  return name_of(outcome, {{kEmpty, "empty"},
                           {kProposed, "proposed"},
                           {kConverged, "converged"},
                           {kAtLimit, "stopped at a limit"},
                           {kStopped, "interrupted"},
                           {kNoObject, "no object"},
                           {kVanished, "vanished"}});
}

int exit_code(Outcome outcome) {
  switch (outcome) {
    case Outcome::kAtLimit:
      return 5;
    case Outcome::kNoObject:
    case Outcome::kVanished:
      return 8;
    case Outcome::kStopped:
      return 130;
    default:
      return 0;
  }
}

bool has_shape(Outcome outcome) {
  return outcome != Outcome::kEmpty && outcome != Outcome::kNoObject &&
         outcome != Outcome::kVanished;
}

Outcome outcome_of(flow::Termination termination) {
  switch (termination) {
    case flow::Termination::kMaxSteps:
    case flow::Termination::kRising:
    case flow::Termination::kObstacle:
      return Outcome::kAtLimit;
    case flow::Termination::kStopped:
      return Outcome::kStopped;
    default:
      return Outcome::kConverged;
  }
}

}  // namespace surf::segment
