// --memory: what a run may use.
#pragma once

#include <cstddef>
#include <string>

namespace surfseg {

/// Holds the process to so much memory from now on: more than that cannot be had, and ends in one
/// line (code 3).
/// @param text  such as "2GB" or "800MB"; empty: no limit
/// @return      bytes for fields that are kept though nobody uses them now
/// @throws surf::UsageError  no such size, or less than the libraries themselves need
std::size_t limit_memory(const std::string& text);

}  // namespace surfseg
