// Pages that are built into a program.
#pragma once

#include <string_view>

namespace surfseg {

/// The three files of a page: its HTML with marks where the others are put in.
struct PageFiles {
  std::string_view html, style, script;
};

}  // namespace surfseg
