// Numbers and names in text files; private to io/*.cpp.
#pragma once

#include <charconv>
#include <string>

namespace surf::io {

/// All digits: whether a reader keeps floats or doubles, it gets the same number, also of a float.
inline void append_number(std::string& text, double value) {
  char digits[32];
  const auto [end, status] = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, end);
}

/// As XML wants it in elements and in attributes.
inline std::string xml_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

}  // namespace surf::io
