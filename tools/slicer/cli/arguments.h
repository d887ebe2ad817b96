// The parser that the table of parameters makes, and what was typed in words of `surfseg segment`.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/common/cli_app.h"
#include "tools/slicer/cli/parameters.h"

namespace surfseg::slicer {

/// What was typed, and what hosts pass beside it.
struct Arguments {
  std::string volume;
  std::map<std::string, std::vector<std::string>> values;  ///< by the parameter's name
  std::map<std::string, bool> flags;
  std::string return_file;        ///< where to write what is given back
  std::string progress = "tags";  ///< or "none"
  std::vector<std::string> surplus;

  /// The only value, "" if there is none.
  std::string value(const std::string& name) const;
};

/// @param app, arguments  each keeps the other
void add_parameters(CLI::App& app, const std::vector<Parameter>& parameters, Arguments& arguments);

/// What can be found wrong in them at once.
/// @throws surf::UsageError
void check(const Arguments& arguments, const std::vector<Parameter>& parameters);

/// Options and points as words after `surfseg segment --space lps`, in the order in which they were
/// typed. What is at its standard is left out: hosts pass it always, and it would win over a
/// preset's.
/// @throws surf::InputError  a file of points cannot be read
std::vector<std::string> segment_words(const CLI::App& app,
                                       const std::vector<Parameter>& parameters,
                                       const Arguments& arguments);

/// A message with the flags of the table for options of `surfseg segment`.
std::string with_flags(const std::string& message, const std::vector<Parameter>& parameters);

}  // namespace surfseg::slicer
