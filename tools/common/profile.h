// Where the time and the memory of a run went, as a table for people.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libsurf/segment/stage.h"
#include "tools/common/stage_clock.h"

namespace surfseg {

/// The stages of an object's segmentation; its name is empty if it is the only one.
using ObjectStages = std::pair<std::string, std::vector<surf::segment::StageReport>>;

/// A line for each stage of the clock, those of the objects below "segment", and one for all: wall
/// and CPU seconds, share of the wall time, steps and wall time per step, the largest memory until
/// the stage's end. The same numbers are in the summary.
std::vector<std::string> profile_lines(const StageClock& clock,
                                       const std::vector<ObjectStages>& objects);

}  // namespace surfseg
