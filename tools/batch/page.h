// The parts of group.html, built into the program from tools/batch/page.
#pragma once

#include <string_view>

namespace surfseg::batch {

std::string_view page_html();
std::string_view page_style();
std::string_view page_script();

}  // namespace surfseg::batch
