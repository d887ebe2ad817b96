// The list of a batch: which scan is segmented how, under which name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/batch/clicks_cell.h"

namespace surfseg::batch {

/// What a row means where its own cell is empty.
struct CaseDefaults {
  std::string space = "ras", preset;
};

struct Case {
  std::string name;  ///< letters and digits; no other case has it
  int line = 0;      ///< of the list
  /// The row as it is written, with defaults, but for the name: with the files' contents it
  /// decides what comes out.
  std::map<std::string, std::string> settings;
  std::map<std::string, std::string> stated;  ///< the same without defaults
  std::string scan;
  std::string recipe;  ///< to be replayed, in place of clicks
  ClicksCell clicks;
  std::string space;
  std::vector<std::string> options;  ///< further words of `surfseg segment` or `replay`
  std::string reference;             ///< mesh or label map to compare with
  std::string reference_label;       ///< a number; empty = all labels; of one object
  std::vector<std::string> files;    ///< all that are read, but for those of presets
};

/// Every row of the list; files are looked for from the list's folder on. Whether they are there
/// is seen when the case is done.
/// @throws surf::InputError  "LIST:ROW: ...": the first thing that is wrong in it: an unknown or
///                           missing column, a name that is unfit or there twice, a cell that is
///                           missing or that `surfseg segment` would refuse
std::vector<Case> read_cases(const std::string& path, const CaseDefaults& defaults);

}  // namespace surfseg::batch
