// PNG files in memory, by libpng.
#pragma once

#include <string>

namespace surf::io {

/// The file's bytes; the same pixels give the same.
/// @param n_components  1 (grey) or 3 (red, green, blue)
/// @param n_bits        8 or 16 for each component
/// @param pixels        row by row from the top left, components together
std::string png_bytes(int width, int height, int n_components, int n_bits, const void* pixels);

}  // namespace surf::io
