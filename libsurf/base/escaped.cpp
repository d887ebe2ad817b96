#include "libsurf/base/escaped.h"

#include <algorithm>

namespace surf {

std::string escaped(std::string_view text,
                    std::initializer_list<std::pair<char, std::string_view>> replacements) {
  std::string out;
  for (const char c : text) {
    const auto found = std::find_if(replacements.begin(), replacements.end(),
                                    [&](const auto& entry) { return entry.first == c; });
    out += found == replacements.end() ? std::string_view(&c, 1) : found->second;
  }
  return out;
}

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 127; }, '?');
  return text;
}

}  // namespace surf
