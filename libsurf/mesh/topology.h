// What a moving surface does where its sheets meet.
#pragma once

namespace surf::mesh {

enum class Topology {
  kFree,   ///< sheets that meet are rebuilt: shells merge, split, get handles and cavities
  kFixed,  ///< sheets are held apart: the topology of the initial surface stays
  kGenus0  ///< free, but what would leave a shell with a handle is held apart
};

}  // namespace surf::mesh
