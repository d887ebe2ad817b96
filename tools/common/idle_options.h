// Options that are given and do nothing, and shorthands that change more than they say.
#pragma once

#include <string>
#include <vector>

#include "tools/common/cli_app.h"
#include "tools/common/run_arguments.h"

namespace surfseg {

/// One sentence for each, such as "--levels has no effect without --energy". An option with its
/// default value is not one: a summary that is fed back as --config has them all.
/// @param has_initial  the evolution starts from a shape that is given, not from balls
std::vector<std::string> idle_options(const CLI::App& command, const RunArguments& a,
                                      bool has_initial);

}  // namespace surfseg
