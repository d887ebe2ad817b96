// JPEG files in memory, by libjpeg.
#pragma once

#include <cstdint>
#include <string>

namespace surf::io {

/// The file's bytes, with colours for 2 x 2 pixels.
/// @param pixels   red, green, blue, row by row from the top left
/// @param quality  1 to 100
/// @throws OutputError  libjpeg's reason
std::string jpeg_bytes(int width, int height, const std::uint8_t* pixels, int quality);

}  // namespace surf::io
