// Work that Python can look at and stop.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <stop_token>
#include <string>

#include "libsurf/flow/evolution.h"

namespace surfseg::python {

namespace py = pybind11;

/// Called by the work after each step; false asks it to end with what it has.
using Watch = std::function<bool(const std::string& stage, const surf::flow::StepRecord& record)>;

/// Does work(watch, stop) on a thread of its own until it ends. Meanwhile this thread looks for
/// Ctrl-C, and calls progress(stage, step, elements, enclosed, energy, seconds) after a step, at
/// most twenty times a second, and with the last one again where a step takes longer than a tenth
/// of a second. The work waits while progress is called. If that returns False, or raises, or after
/// Ctrl-C, the work is asked to stop.
///
/// @param progress  None is not called
/// @pre  this thread holds the interpreter's lock
/// @throws py::error_already_set  what progress raised, KeyboardInterrupt
/// @throws what the work throws, if progress has not
void do_watched(const py::object& progress,
                const std::function<void(const Watch& watch, const std::stop_token& stop)>& work);

}  // namespace surfseg::python
