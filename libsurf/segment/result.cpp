#include "libsurf/segment/result.h"

#include <algorithm>

namespace surf::segment {

template <int Dim>
const StageReport* Result<Dim>::main_stage() const {
  const auto minimises = [](const StageReport& stage) {
    return stage.kind == StageKind::kMinimises;
  };
  const auto at = std::find_if(stages.rbegin(), stages.rend(), minimises);
  if (at != stages.rend()) return &*at;
  return stages.empty() ? nullptr : &stages.back();
}

template <int Dim>
const StageReport* Result<Dim>::ending_stage() const {
  return !stages.empty() && stages.back().outcome == Outcome::kStopped ? &stages.back()
                                                                       : main_stage();
}

template <int Dim>
int Result<Dim>::n_steps() const {
  int n = 0;
  for (const StageReport& stage : stages) n += int(stage.flow.steps.size());
  return n;
}

template struct Result<2>;
template struct Result<3>;

}  // namespace surf::segment
