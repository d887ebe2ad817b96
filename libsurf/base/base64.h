// Bytes as text.
#pragma once

#include <string>
#include <string_view>

namespace surf {

/// The bytes in base64 of RFC 4648, padded with '='.
std::string base64(std::string_view bytes);

}  // namespace surf
