#include "libsurf/io/read_landmarks.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/io/detail/surface_formats.h"

namespace surf::io {
namespace {

using nlohmann::json;
using Rows = std::vector<std::vector<double>>;

std::string content_of(const std::string& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad())
    throw InputError(
        fmt::format("{}: cannot read the landmarks: {}", path, std::strerror(errno ? errno : EIO)));
  return text;
}

std::vector<std::string_view> split(std::string_view line, std::string_view dividers,
                                    bool keeps_empty) {
  std::vector<std::string_view> out;
  while (true) {
    const std::size_t end = std::min(line.find_first_of(dividers), line.size());
    if (keeps_empty || end > 0) out.push_back(line.substr(0, end));
    if (end == line.size()) return out;
    line.remove_prefix(end + 1);
  }
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

double number(const std::string& path, std::size_t line, std::string_view word) {
  const auto value = to_number<double>(trimmed(word));
  if (!value || !std::isfinite(*value))
    throw InputError(fmt::format("{}:{}: expected a coordinate; got '{}'", path, line, word));
  return *value;
}

Space space_of(const std::string& path, std::string_view word) {
  if (word == "LPS" || word == "1") return Space::kLps;
  if (word == "RAS" || word == "0") return Space::kRas;
  throw InputError(fmt::format("{}: the coordinate system is {}; expected LPS or RAS", path, word));
}

/// What follows "key =" in a comment, else empty.
std::string_view value_of(std::string_view comment, std::string_view key) {
  const std::size_t at = comment.find(key);
  const std::size_t equals = comment.find('=', at == std::string_view::npos ? at : at + key.size());
  if (at == std::string_view::npos || equals == std::string_view::npos) return {};
  return trimmed(comment.substr(equals + 1));
}

void to_ras(std::vector<double>& point, Space space) {
  if (space != Space::kLps) return;
  point[0] = -point[0];
  point[1] = -point[1];
}

Rows read_fcsv(const std::string& path, std::string_view content) {
  Rows rows;
  Space space = Space::kRas;
  std::size_t first = 1;  // column of x: id,x,y,z,...
  Lines lines(content);
  while (lines.next()) {
    const std::string_view line = lines.line();
    if (line.starts_with('#')) {
      if (const auto word = value_of(line, "CoordinateSystem"); !word.empty())
        space = space_of(path, word);
      const auto columns = split(value_of(line, "columns"), ",", true);
      for (std::size_t i = 0; i + 2 < columns.size(); ++i)
        if (trimmed(columns[i]) == "x") first = i;
      continue;
    }
    if (trimmed(line).empty()) continue;
    const auto words = split(line, ",", true);
    if (words.size() < first + 3)
      throw InputError(
          fmt::format("{}:{}: expected id,x,y,z,...; got '{}'", path, lines.number(), line));
    rows.push_back({});
    for (std::size_t i = first; i < first + 3; ++i)
      rows.back().push_back(number(path, lines.number(), words[i]));
    to_ras(rows.back(), space);
  }
  return rows;
}

/// "mm", or a list that begins with it; that is also what a missing unit means.
bool is_in_mm(const json& list) {
  if (!list.contains("coordinateUnits")) return true;
  const json& unit = list["coordinateUnits"];
  return unit == "mm" || (unit.is_array() && !unit.empty() && unit[0] == "mm");
}

Rows read_markups(const std::string& path, const std::string& content) {
  Rows rows;
  try {
    const json document = json::parse(content);
    for (const json& list : document.at("markups")) {
      const Space space = space_of(path, list.value("coordinateSystem", "LPS"));
      if (!is_in_mm(list))
        throw InputError(fmt::format("{}: coordinateUnits: expected mm; got {}", path,
                                     list["coordinateUnits"].dump()));
      for (const json& point : list.at("controlPoints")) {
        if (point.value("positionStatus", "defined") != "defined") continue;
        rows.push_back(point.at("position").get<std::vector<double>>());
        if (rows.back().size() != 3)
          throw InputError(fmt::format("{}: position: expected three numbers; got {}", path,
                                       point["position"].dump()));
        to_ras(rows.back(), space);
      }
    }
  } catch (const json::exception& error) {
    throw InputError(fmt::format("{}: no markups file of Slicer: {}", path, error.what()));
  }
  return rows;
}

Rows read_text(const std::string& path, std::string_view content, std::optional<Space>& space) {
  Rows rows;
  Lines lines(content);
  while (lines.next()) {
    const std::string_view line = trimmed(lines.line());
    if (line.starts_with('#') && !space) space = stated_space(line, path);
    if (line.starts_with('#') || line.empty()) continue;
    rows.push_back({});
    for (const std::string_view word : split(line, " \t,;", false))
      rows.back().push_back(number(path, lines.number(), word));
    const std::size_t n = rows.back().size();
    if (n != rows.front().size() || n < 2 || n > 3)
      throw InputError(
          fmt::format("{}:{}: expected two or three coordinates, as many in every line; got '{}'",
                      path, lines.number(), line));
  }
  if (space && !rows.empty() && rows.front().size() == 2)
    throw InputError(fmt::format("{}: SPACE needs three coordinates a line", path));
  if (space)
    for (auto& row : rows) to_ras(row, *space);
  return rows;
}

}  // namespace

Landmarks read_landmarks(const std::string& path) {
  const std::string content = content_of(path);
  Landmarks out;
  Rows rows;
  std::optional<Space> space = Space::kRas;
  if (path.ends_with(".fcsv"))
    rows = read_fcsv(path, content);
  else if (path.ends_with(".json"))
    rows = read_markups(path, content);
  else
    rows = read_text(path, content, space = std::nullopt);
  if (rows.empty()) throw InputError(fmt::format("{}: there are no landmarks in it", path));
  out.is_ras = space.has_value();
  out.points.resize(Eigen::Index(rows.size()), Eigen::Index(rows.front().size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    out.points.row(Eigen::Index(i)) =
        Eigen::Map<const Eigen::RowVectorXd>(rows[i].data(), Eigen::Index(rows[i].size()));
  return out;
}

}  // namespace surf::io
