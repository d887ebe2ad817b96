#include <fmt/format.h>

#include "libsurf/io/detail/surface_formats.h"

namespace surf::io {
namespace {

/// Vertex of a corner "7", "7/1", "7//3" or "-1" (the last vertex so far), from 0.
std::int64_t read_corner(const std::string& path, const Lines& lines, std::string_view word,
                         std::size_t n_points) {
  const auto index = to_number<std::int64_t>(word.substr(0, word.find('/')));
  if (!index || *index == 0)
    throw InputError(
        fmt::format("{}:{}: expected vertex numbers from 1; got '{}'", path, lines.number(), word));
  return *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(n_points);
}

void read_face(const std::string& path, Lines& lines, FileSurface& surface) {
  std::vector<std::int64_t> polygon;
  for (std::string_view word = lines.word(); !word.empty(); word = lines.word())
    polygon.push_back(read_corner(path, lines, word, surface.points.size()));
  if (polygon.size() < 3)
    throw InputError(fmt::format("{}:{}: a face with {} vertices; expected 3 or more", path,
                                 lines.number(), polygon.size()));
  surface.add_polygon(polygon);
  surface.lines.resize(surface.elements.size(), lines.number());
}

}  // namespace

FileSurface read_obj(const std::string& path, const std::string& content) {
  FileSurface surface;
  Lines lines(content);
  while (lines.next()) {
    const std::string_view keyword = lines.word();
    if (keyword.starts_with('#') && !surface.space)
      surface.space = stated_space(lines.line(), path);
    if (keyword == "v") surface.points.push_back(read_point(path, lines));
    if (keyword == "f") read_face(path, lines, surface);
  }
  return surface;
}

}  // namespace surf::io
