#include "tools/surfseg/slice_picture.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "tools/common/arguments.h"
#include "tools/common/option_group.h"

namespace surfseg {
namespace {

int parse_count(const std::string& option, const std::string& part, const std::string& text) {
  double n = 0;
  try {
    n = parse_number(option, part);
  } catch (const surf::UsageError&) {
  }
  if (!(n >= 1 && n <= 400 && n == std::floor(n)))
    throw surf::UsageError(fmt::format(
        "{}: expected a number of slices from 1 to 400, or COLUMNSxROWS, such as 12 or 4x3; got "
        "'{}'",
        option, text));
  return static_cast<int>(n);
}

}  // namespace

std::array<double, 2> parse_window(const std::string& option, const std::string& text) {
  if (const auto window = surf::io::ct_window(text)) return *window;
  const auto numbers = parse_numbers(
      option, text, 2,
      fmt::format("{} or LOW,HIGH, such as -160,240", fmt::join(surf::io::ct_windows(), ", ")));
  return {numbers[0], numbers[1]};
}

SheetSize parse_sheet(const std::string& option, const std::string& text) {
  if (const std::size_t cross = text.find('x'); cross != std::string::npos) {
    const int columns = parse_count(option, text.substr(0, cross), text);
    return {columns * parse_count(option, text.substr(cross + 1), text), columns};
  }
  const int n = parse_count(option, text, text);
  return {n, static_cast<int>(std::ceil(std::sqrt(n)))};
}

void add_picture_option(CLI::App& command, std::string& picture, const std::string& group) {
  OptionGroup(command, group)
      .add("--picture", picture,
           "Picture of three slices with the surface's outline and the clicks: .png");
}

void add_thumbnail_option(CLI::App& command, std::string& thumbnail, const std::string& group) {
  OptionGroup(command, group)
      .add("--thumbnail", thumbnail,
           fmt::format("The same, {} pixels wide: .png", kThumbnailWidth));
}

void write_picture(const std::string& picture, const surf::Triangles& surface,
                   const surf::volume::Volume& volume,
                   const std::vector<surf::segment::Click<3>>& clicks,
                   const std::optional<int>& width) {
  if (picture.empty()) return;
  surf::io::SliceOptions options;
  if (width) options.width = *width;
  for (const auto& click : clicks)
    options.marks.push_back({click.point_mm, click.side == surf::segment::Side::kInside});
  surf::io::write_png(picture, surf::io::draw_slices(surface, volume, options));
}

}  // namespace surfseg
