// What --xml prints: the description of a command line module that Slicer and MITK make a window
// from.
#pragma once

#include <string>
#include <vector>

#include "tools/slicer/cli/parameters.h"

namespace surfseg::slicer {

/// The two differ in one thing: a value that the program gives back has the index 1000 by CTK's
/// schema, and none at all for Slicer, which would take one with an index for an argument.
enum class Dialect { kCtk, kSlicer };

std::string description(const std::vector<Group>& groups, const std::string& version,
                        Dialect dialect);

/// With &, < and > as entities.
std::string xml_text(const std::string& text);

}  // namespace surfseg::slicer
