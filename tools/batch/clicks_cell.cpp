#include "tools/batch/clicks_cell.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "libsurf/base/error.h"
#include "libsurf/io/read_landmarks.h"

namespace surfseg::batch {
namespace {

std::string trimmed(std::string text) {
  text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

/// A mark and numbers as options take them: blanks stay where they part digits, which is refused.
std::string point_of(const std::string& part) {
  const std::string text = trimmed(part);
  const std::size_t n_marks = text.starts_with('!') ? 1 : 0;
  std::string out = text.substr(0, n_marks);
  for (std::size_t begin = n_marks; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    out += (begin == n_marks ? "" : ",") + trimmed(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return out;
}

/// Numbers and commas, perhaps after a mark; how many a point has is checked later.
bool is_point(const std::string& text) {
  return text.find(',') != std::string::npos &&
         text.find_first_not_of("!+-.,0123456789eE ") == std::string::npos;
}

bool is_list_of_points(const std::string& text) {
  const std::vector<std::string> parts = parts_of(text);
  const auto is_click = [](const std::string& part) {
    const std::size_t colon = part.find(':');
    return is_point(part.substr(colon == std::string::npos ? 0 : colon + 1));
  };
  return std::any_of(parts.begin(), parts.end(), is_click);
}

void add_point(const std::string& part, std::vector<std::string>& words) {
  const std::string point = point_of(part);
  words.push_back(point.starts_with('!') ? "--outside=" + point.substr(1) : "--seed=" + point);
}

}  // namespace

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> out;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    const std::string part = trimmed(text.substr(begin, end - begin));
    if (!part.empty()) out.push_back(part);
    begin = end + 1;
  }
  return out;
}

bool is_label(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return c < 128 && std::isalnum(c) != 0;
  });
}

ClicksCell parse_clicks(const std::string& text) {
  ClicksCell out;
  if (!is_list_of_points(text)) {
    out.file = text;
    return out;
  }
  for (const std::string& part : parts_of(text)) {
    const std::size_t colon = part.find(':');
    if (colon == std::string::npos) {
      add_point(part, out.words);
      continue;
    }
    const std::string name = trimmed(part.substr(0, colon));
    if (!is_label(name))
      throw surf::UsageError(fmt::format(
          "clicks: expected an object's name of letters and digits before the colon; got '{}'",
          part.substr(0, colon)));
    out.objects.push_back(name);
    out.words.push_back("--object=" + name);
    add_point(part.substr(colon + 1), out.words);
  }
  return out;
}

std::vector<std::string> point_words(const std::string& option, const std::string& text) {
  std::vector<std::string> out;
  for (const std::string& part : parts_of(text))
    out.push_back(fmt::format("--{}={}", option, point_of(part)));
  return out;
}

std::vector<std::string> landmark_words(const std::string& path, std::string& space) {
  const surf::io::Landmarks landmarks = surf::io::read_landmarks(path);
  if (landmarks.points.cols() != 3 || landmarks.points.rows() == 0)
    throw surf::InputError(fmt::format("clicks: {}: has no points of three coordinates", path));
  if (landmarks.is_ras) space = "ras";
  std::vector<std::string> out;
  for (Eigen::Index n = 0; n < landmarks.points.rows(); ++n)
    out.push_back(fmt::format("--seed={},{},{}", landmarks.points(n, 0), landmarks.points(n, 1),
                              landmarks.points(n, 2)));
  return out;
}

}  // namespace surfseg::batch
