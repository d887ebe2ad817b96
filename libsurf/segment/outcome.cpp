#include "libsurf/segment/outcome.h"

namespace surf::segment {

std::string to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kEmpty:
      return "empty";
    case Outcome::kProposed:
      return "proposed";
    case Outcome::kConverged:
      return "converged";
    case Outcome::kAtLimit:
      return "stopped at a limit";
    case Outcome::kStopped:
      return "interrupted";
    case Outcome::kNoObject:
      return "no object";
    case Outcome::kVanished:
      break;
  }
  return "vanished";
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
    case flow::Termination::kObstacle:
      return Outcome::kAtLimit;
    case flow::Termination::kStopped:
      return Outcome::kStopped;
    default:
      return Outcome::kConverged;
  }
}

}  // namespace surf::segment
