#include "tools/batch/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "libsurf/base/error.h"

namespace surfseg::batch {
namespace {

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \r");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \r") - begin + 1);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> out;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find('\t', begin);
    out.push_back(trimmed(line.substr(begin, end - begin)));
    if (end == std::string::npos) return out;
    begin = end + 1;
  }
}

void check_columns(const std::vector<std::string>& columns, const std::string& where) {
  for (std::size_t n = 0; n < columns.size(); ++n) {
    if (columns[n].empty())
      throw surf::InputError(fmt::format("{}: column {} has no name", where, n + 1));
    if (std::find(columns.begin(), columns.begin() + std::ptrdiff_t(n), columns[n]) !=
        columns.begin() + std::ptrdiff_t(n))
      throw surf::InputError(fmt::format("{}: column '{}' is there twice", where, columns[n]));
  }
}

TableRow row_of(const std::vector<std::string>& columns, const std::vector<std::string>& cells,
                int line, const std::string& where) {
  TableRow row{line, {}};
  for (std::size_t n = 0; n < cells.size(); ++n) {
    if (cells[n].empty()) continue;
    if (n >= columns.size())
      throw surf::InputError(
          fmt::format("{}: has {} cells, but there are {} columns; they are "
                      "apart by tabs",
                      where, cells.size(), columns.size()));
    if (cells[n] != "n/a") row.cells[columns[n]] = cells[n];
  }
  return row;
}

}  // namespace

Table read_table(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path))
    throw surf::InputError(fmt::format("{}: cannot be read: {}", path,
                                       stream ? "it is a folder" : std::strerror(errno)));
  Table table;
  std::string text;
  for (int line = 1; std::getline(stream, text); ++line) {
    if (line == 1 && text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    if (text.starts_with('#') || text.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string where = fmt::format("{}:{}", path, line);
    if (table.columns.empty()) {
      table.columns = split(text);
      check_columns(table.columns, where);
    } else {
      table.rows.push_back(row_of(table.columns, split(text), line, where));
    }
  }
  if (table.columns.empty())
    throw surf::InputError(fmt::format(
        "{}: is empty; its first line names the columns, such as scan, clicks, name", path));
  return table;
}

std::string cell(const std::string& text) {
  if (text.empty()) return "n/a";
  std::string out = text;
  std::replace_if(
      out.begin(), out.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  return out;
}

}  // namespace surfseg::batch
