// The page, built into the program (tools/studio/CMakeLists.txt).
#pragma once

#include <string_view>
#include <vector>

namespace surfseg::studio {

struct PageFile {
  std::string_view path, type;  ///< "/studio.js", "text/javascript; charset=utf-8"
  std::string_view gzip;        ///< its bytes, compressed
};

std::vector<PageFile> page_files();

}  // namespace surfseg::studio
