// Text from outside in pages.
#pragma once

#include <string>

namespace surfseg {

/// With character references for & < > " ', for text and for attributes in quotes.
std::string html_text(const std::string& text);

/// JSON such that nothing of it ends the script that it stands in.
std::string json_in_script(std::string json);

/// Replaces the first place of `mark`, which must be there.
void put(std::string& page, const std::string& mark, const std::string& text);

}  // namespace surfseg
