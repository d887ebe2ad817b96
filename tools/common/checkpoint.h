// --checkpoint and --resume: a run that was killed goes on from the last stage that it finished.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "libsurf/segment/checkpointing.h"

namespace surfseg {

/// The file of --checkpoint: what was asked, and for each object the state after its last stage.
/// It is written whole or not at all, so that a kill at any moment leaves the one before.
class Checkpoint {
 public:
  /// @param argument  "FILE", or "FILE,SECONDS": no oftener than that; empty: there is none
  /// @param resumes   --resume: goes on from the file, if it is there
  /// @throws surf::UsageError  SECONDS is no number, --resume without a file
  Checkpoint(const std::string& argument, bool resumes);

  const std::string& path() const { return path_; }

  /// Reads the file, if there is one and it is to go on from it.
  /// @param asked  gives the image, clicks and options, as text; called only where there is a file
  /// @throws surf::InputError  the file is none, or of another image, program or other options
  void begin(const std::function<std::string()>& asked);
  /// Of the n-th object. Lives no longer than this.
  surf::segment::Checkpointing of(std::size_t n);
  /// When all is written nothing is left to go on from.
  void remove() const;

 private:
  void keep(std::size_t n, const std::string& state);

  std::string path_, asked_;
  double least_seconds_ = 0;
  bool resumes_ = false;
  std::vector<std::string> states_;
  std::chrono::steady_clock::time_point written_ = {};
};

}  // namespace surfseg
