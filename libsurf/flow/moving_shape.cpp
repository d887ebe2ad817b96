#include "libsurf/flow/moving_shape.h"

namespace surf::flow {

std::string to_string(TopologyChange change) {
  switch (change) {
    case TopologyChange::kUntangling:
      return "untangling";
    case TopologyChange::kMerging:
      return "merging";
    case TopologyChange::kSelfMerging:
      return "self-merging";
    case TopologyChange::kSelfCrossing:
      return "self-crossing";
    case TopologyChange::kHandleClosing:
      return "handle-closing";
    case TopologyChange::kSplitting:
      return "splitting";
    case TopologyChange::kInsideOpening:
      return "inside-opening";
    case TopologyChange::kVanishing:
      break;
  }
  return "vanishing";
}

}  // namespace surf::flow
