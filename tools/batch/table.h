// Tables as files of tab-separated values.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace surfseg::batch {

struct TableRow {
  int line = 0;  ///< of the file, from 1
  /// By column; empty cells and "n/a" are left out.
  std::map<std::string, std::string> cells;
};

struct Table {
  std::vector<std::string> columns;
  std::vector<TableRow> rows;
};

/// The first line names the columns. Blank lines and those that begin with # are left out, blanks
/// round a cell too; lines may end as on Windows.
/// @throws surf::InputError  "FILE:LINE: ...": unreadable, no column, a column without a name or
///                           twice, more cells than columns
Table read_table(const std::string& path);

/// A cell that holds any text: without tabs and line ends; "n/a" for nothing.
std::string cell(const std::string& text);

}  // namespace surfseg::batch
