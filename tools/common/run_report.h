// What a run says of itself: progress line, exit code, its part of the summary.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "libsurf/segment/run.h"
#include "tools/common/exit_codes.h"

namespace surfseg {

/// "evolve  step 12  J ...  tau ...  triangles ...  volume ... mm^3"
/// @param elements, content, unit  "triangles", "volume", "mm^3"
std::string step_line(const std::string& stage, const surf::flow::StepRecord& record,
                      const char* elements, const char* content, const char* unit, double seconds);

/// A signal's code, 5 if the run was stopped at its limit of steps, else 0.
template <int Dim>
ExitCode exit_code_of(const surf::segment::RunResult<Dim>& result);

/// energy, iterations, stop_reason, stop_message; nothing if there was no stage.
template <int Dim>
nlohmann::ordered_json outcome_of(const surf::segment::RunResult<Dim>& result);

/// topology_events, notes, chosen, candidates, evolution.
template <int Dim>
nlohmann::ordered_json history_of(const surf::segment::RunResult<Dim>& result);

/// "converged after 12 steps: ..."
template <int Dim>
std::string conclusion_of(const surf::segment::RunResult<Dim>& result);

}  // namespace surfseg
