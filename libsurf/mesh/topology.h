// What a moving surface does where its sheets meet.
#pragma once

namespace surf::mesh {

enum class Topology {
  kFree,   ///< sheets that meet are rebuilt: shells merge, split, get handles and cavities
  kFixed,  ///< sheets are held apart: the topology of the initial surface stays
  kGenus0  ///< free, but what would leave a shell with a handle is held apart
};

/// How far a step goes that brings sheets together (thesis Alg. 10).
enum class StepAdjustment {
  kNone,         ///< as far as it goes; all events are resolved then
  kCatchFirst,   ///< to just before the first event
  kResolveFirst  ///< to just after the first event, which is resolved then
};

}  // namespace surf::mesh
