// Pictures of slices: their options, and the one that segment makes.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/io/slices.h"
#include "libsurf/segment/click.h"
#include "tools/common/cli_app.h"

namespace surfseg {

/// "soft-tissue", ... or "LOW,HIGH".
/// @throws surf::UsageError
std::array<double, 2> parse_window(const std::string& option, const std::string& text);

struct SheetSize {
  int n_slices, columns;
};
/// "N" slices, in as many columns as rows or one more, or "COLUMNSxROWS".
/// @throws surf::UsageError
SheetSize parse_sheet(const std::string& option, const std::string& text);

void add_picture_option(CLI::App& command, std::string& picture, const std::string& group);

/// Of --thumbnail, in pixels.
constexpr int kThumbnailWidth = 480;
void add_thumbnail_option(CLI::App& command, std::string& thumbnail, const std::string& group);

/// Writes draw_slices() of the surface with the clicks; nothing if `picture` is empty.
/// @param width  in pixels; none = that of io::SliceOptions
/// @throws surf::OutputError
void write_picture(const std::string& picture, const surf::Triangles& surface,
                   const surf::volume::Volume& volume,
                   const std::vector<surf::segment::Click<3>>& clicks,
                   const std::optional<int>& width = {});

}  // namespace surfseg
