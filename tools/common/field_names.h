// What the library calls by the field of its options, by the option of the command line.
#pragma once

#include <string>

namespace surfseg {

/// "Options::coarseness = 0 violates >= 1" as "--coarseness = 0 violates >= 1"; fields that have
/// no option stay as they are.
/// @param program  "surfseg" or "curveseg", whose options for content differ
std::string with_option_names(const std::string& message, const std::string& program);

}  // namespace surfseg
