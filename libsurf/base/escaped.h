// Text with some characters written otherwise, as a format wants it.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace surf {

/// The text with each of these characters replaced.
std::string escaped(std::string_view text,
                    std::initializer_list<std::pair<char, std::string_view>> replacements);

/// The text with '?' for its control characters: what messages say of text from outside.
std::string one_line(std::string text);

}  // namespace surf
