#include "tools/common/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "libsurf/base/error.h"

namespace surfseg {
namespace {

/// The number at the front of text, which is shortened by it; nothing if there is none or
/// it is not finite.
std::optional<double> take_number(std::string_view& text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc() || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(end - text.data());
  return value;
}

/// What to add where a comma may stand for a decimal point.
const char* of_comma(const std::string& text) {
  return text.find(',') != std::string::npos ? " (decimals are written with a point, not a comma)"
                                             : "";
}

}  // namespace

Length parse_length(const std::string& option, const std::string& text) {
  std::string_view rest = text;
  const auto value = take_number(rest);
  if (!value || (rest != "mm" && rest != "vox" && rest != "px"))
    throw surf::UsageError(
        fmt::format("{}: expected a length with its unit, such as 12mm or 20vox; got '{}'{}",
                    option, text, of_comma(text)));
  if (*value < 0)
    throw surf::UsageError(fmt::format("{}: a length cannot be negative; got '{}'", option, text));
  return {*value, rest != "mm"};
}

Length parse_positive_length(const std::string& option, const std::string& text) {
  const Length length = parse_length(option, text);
  if (length.value == 0)
    throw surf::UsageError(fmt::format("{}: a length must be positive; got '{}'", option, text));
  return length;
}

Space parse_space(const std::string& option, const std::string& text) {
  if (text == "ras") return Space::kRas;
  if (text == "lps") return Space::kLps;
  if (text == "ijk") return Space::kIjk;
  throw surf::UsageError(fmt::format("{}: expected ras, lps or ijk; got '{}'", option, text));
}

double parse_number(const std::string& option, const std::string& text) {
  std::string_view rest = text;
  const auto value = take_number(rest);
  if (!value || !rest.empty())
    throw surf::UsageError(
        fmt::format("{}: expected a number; got '{}'{}", option, text, of_comma(text)));
  return *value;
}

std::vector<double> parse_numbers(const std::string& option, const std::string& text, int n,
                                  const std::string& expected) {
  const auto fail = [&] {
    const bool has_more = std::count(text.begin(), text.end(), ',') >= n;
    return surf::UsageError(fmt::format("{}: expected {}; got '{}'{}", option, expected, text,
                                        has_more ? of_comma(text) : ""));
  };
  std::string_view rest = text;
  std::vector<double> numbers;
  for (int i = 0; i < n; ++i) {
    if (i > 0) {
      if (rest.empty() || rest.front() != ',') throw fail();
      rest.remove_prefix(1);
    }
    const auto value = take_number(rest);
    if (!value) throw fail();
    numbers.push_back(*value);
  }
  if (!rest.empty()) throw fail();
  return numbers;
}

Eigen::Vector3d parse_point(const std::string& option, const std::string& text) {
  const auto numbers = parse_numbers(option, text, 3, "three numbers X,Y,Z");
  return {numbers[0], numbers[1], numbers[2]};
}

std::array<std::string, 2> split_box(const std::string& option, const std::string& text,
                                     int dimension) {
  const std::string point = dimension == 3 ? "X,Y,Z" : "X,Y";
  parse_numbers(option, text, 2 * dimension,
                fmt::format("{} numbers {},{}", 2 * dimension, point, point));
  std::size_t middle = std::string::npos;
  for (int n = 0; n < dimension; ++n) middle = text.find(',', middle + 1);
  return {text.substr(0, middle), text.substr(middle + 1)};
}

Eigen::Vector3d to_ras_mm(const Eigen::Vector3d& point, Space space,
                          const Eigen::Affine3d& index_to_world) {
  switch (space) {
    case Space::kLps:
      return {-point[0], -point[1], point[2]};
    case Space::kIjk:
      return index_to_world * point;
    case Space::kRas:
      break;
  }
  return point;
}

}  // namespace surfseg
