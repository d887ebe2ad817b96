#include "libsurf/flow/moving_shape.h"

#include "libsurf/base/names.h"

namespace surf::flow {

std::string to_string(TopologyChange change) {
  using enum TopologyChange;
  return name_of(change, {{kUntangling, "untangling"},
                          {kMerging, "merging"},
                          {kSelfMerging, "self-merging"},
                          {kSelfCrossing, "self-crossing"},
                          {kHandleClosing, "handle-closing"},
                          {kSplitting, "splitting"},
                          {kInsideOpening, "inside-opening"},
                          {kVanishing, "vanishing"}});
}

}  // namespace surf::flow
