// The parts of a report, built into the program from tools/report/page.
#pragma once

#include <string_view>

namespace surfseg::report {

std::string_view page_html();
std::string_view page_style();
std::string_view page_script();

}  // namespace surfseg::report
