// Runs the stages that were planned.
#pragma once

#include "libsurf/segment/checkpointing.h"
#include "libsurf/segment/result.h"

namespace surf::segment {

/// The first stage alone: work.proposals, and the best one as shape.
template <int Dim>
void run_proposal(Work<Dim>& work);

/// All that plan() lists, until one of them says that nothing comes after it. A correction that
/// makes the shape intersect itself is taken back. Then what the options rule out goes.
/// @throws InputError  the state to go on from is none of these stages
template <int Dim>
void run_stages(Work<Dim>& work, const Checkpointing& checkpointing = {});

template <int Dim>
Result<Dim> to_result(Work<Dim> work);

}  // namespace surf::segment
