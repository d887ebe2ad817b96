// What the readers of the surface formats share; private to io/read_*.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/io/space.h"

namespace surf::io {

/// A surface as it stands in a file; read_surface checks it and brings it to RAS.
struct FileSurface {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::int64_t, 3>> elements;  ///< from 0; may name missing points
  /// The line each element stands in; empty for binary formats.
  std::vector<std::size_t> lines;
  std::optional<Space> space;
  /// Numbers of the points, one for each, by name; PLY and VTP have such.
  std::map<std::string, std::vector<double>> arrays;

  /// Appends a polygon as a fan round its first vertex.
  void add_polygon(const std::vector<std::int64_t>& vertices) {
    for (std::size_t i = 2; i < vertices.size(); ++i)
      elements.push_back({vertices[0], vertices[i - 1], vertices[i]});
  }
};

/// Readers of the whole content of a file; `path` is for messages. That of VTP is in vtp_file.h.
FileSurface read_stl(const std::string& path, const std::string& content);
FileSurface read_obj(const std::string& path, const std::string& content);
FileSurface read_ply(const std::string& path, const std::string& content);

/// Words of a text, line by line, counting lines from 1.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  /// Takes the next line; false at the end of the text.
  bool next() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line_.ends_with('\r')) line_.remove_suffix(1);
    words_ = line_;
    ++number_;
    return true;
  }
  /// Takes the next word of this line; empty at its end.
  std::string_view word() {
    constexpr std::string_view kBlank = " \t\r\v\f";
    words_.remove_prefix(std::min(words_.find_first_not_of(kBlank), words_.size()));
    const std::string_view result = words_.substr(0, words_.find_first_of(kBlank));
    words_.remove_prefix(result.size());
    return result;
  }
  std::string_view line() const { return line_; }
  std::string_view rest() const { return rest_; }  ///< the text after this line
  std::size_t number() const { return number_; }

 private:
  std::string_view rest_, line_, words_;
  std::size_t number_ = 0;
};

/// The number that is the whole word.
template <class T>
std::optional<T> to_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Three coordinates from the next words of the line.
std::array<double, 3> read_point(const std::string& path, Lines& lines);

}  // namespace surf::io
