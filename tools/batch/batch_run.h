// Cases one after the other, or several at once.
#pragma once

#include <string>
#include <vector>

#include "tools/batch/case_list.h"
#include "tools/common/exit_codes.h"
#include "tools/common/progress.h"

namespace surfseg::batch {

struct RunOptions {
  std::string folder;  ///< of all derivatives, prepared
  int n_jobs = 1;      ///< cases at once
  int n_threads = 0;   ///< of all of them together; 0 = one for each core
  Verbosity verbosity = Verbosity::kNormal;
};

struct RunCounts {
  int n_done = 0, n_skipped = 0, n_failed = 0;
};

/// Runs each case; begins none after a signal. On a terminal one line is rewritten, else each case
/// has a line.
RunCounts run_cases(const std::vector<Case>& cases, const RunOptions& options);

}  // namespace surfseg::batch
