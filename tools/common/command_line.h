// The command line of a run, as text that a shell takes again.
#pragma once

#include <string>
#include <vector>

#include "tools/common/cli_app.h"

namespace surfseg {

/// "surfseg segment ct.nii.gz --seed=1,2,3 ..." in the order in which it was typed, words quoted
/// where a shell needs it.
/// @param skip  options that are left out, by their long names without dashes
std::string command_line(const std::string& program, const CLI::App& command,
                         const std::vector<std::string>& skip);

}  // namespace surfseg
