// One case of a batch: from its row to its files.
#pragma once

#include <string>

#include "tools/batch/case_list.h"
#include "tools/common/exit_codes.h"

namespace surfseg::batch {

struct CaseOutcome {
  bool is_skipped = false;  ///< it was done before, from the same input
  ExitCode exit_code = kDone;
  std::string message;  ///< of a failure: one line
};

/// Whether there is something to look at: a result, or one that was stopped at a limit.
bool is_success(int exit_code);

/// Does what `surfseg segment` or `replay` do, with files in a folder of their own; when all are
/// there they take the place of what was there before, the summary last. After a signal nothing
/// changes, and the exit code is the signal's. What goes wrong is in the summary, too; never
/// throws. Any number of cases of different names may be run at once.
///
/// @param folder  of all derivatives, prepared
CaseOutcome run_case(const Case& row, const std::string& folder);

}  // namespace surfseg::batch
