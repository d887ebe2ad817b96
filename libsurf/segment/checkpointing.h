// Between the stages of a run: what it leaves so that another can go on from there.
#pragma once

#include <functional>
#include <string>

namespace surf::segment {

/// The state is text (JSON), with every number to its last bit: from it the same stages make the
/// same shape, to the byte. What the search found is not in it; that takes seconds, and is found
/// again.
struct Checkpointing {
  /// Called on the thread that runs the stages, after each stage that came to its end.
  std::function<void(const std::string& state)> keep = {};
  /// What keep() was given by an earlier run with the same image, clicks and options; empty: from
  /// the beginning.
  std::string state = {};
};

}  // namespace surf::segment
