// The colour of surfaces that were given none; private to io/*.cpp.
#pragma once

#include <array>
#include <cstdint>

namespace surf::io {

constexpr std::array<std::uint8_t, 3> kBone = {227, 218, 201};  // sRGB

}  // namespace surf::io
