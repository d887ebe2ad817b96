// Pictures of surfaces for studies.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "libsurf/base/error.h"
#include "libsurf/io/render.h"
#include "libsurf/io/write_surface.h"

namespace surf::bench {

/// Writes name.vtp and, where there is a display, name.png; nothing if the folder has no name.
inline void draw(const std::filesystem::path& directory, const std::string& name,
                 const Triangles& surface, const io::RenderOptions& options) {
  if (directory.empty()) return;
  io::write_surface((directory / (name + ".vtp")).string(), surface);
  try {
    io::write_png((directory / (name + ".png")).string(), io::render_surface(surface, options));
  } catch (const OutputError& error) {
    fmt::print(stderr, "{}.png: not drawn: {}\n", name, error.what());
  }
}

}  // namespace surf::bench
