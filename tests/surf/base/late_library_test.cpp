#include "libsurf/base/detail/late_library.h"

#include <gtest/gtest.h>

#include "libsurf/base/error.h"

namespace surf {
namespace {

#ifndef SURFSEG_STATIC
std::string refusal(const std::string& library, const std::string& symbol) {
  try {
    late_symbol(library, symbol);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LateLibrary, IsLoadedOnce) {
  EXPECT_NE(late_symbol("surf_vtk", "surf_read_vti"), nullptr);
  EXPECT_EQ(late_symbol("surf_vtk", "surf_read_vti"), late_symbol("surf_vtk", "surf_read_vti"));
}

TEST(LateLibrary, SaysWhatIsMissing) {
  EXPECT_NE(refusal("surf_nothing", "surf_read_vti").find("libsurf_nothing.so.0.1.0"),
            std::string::npos);
  EXPECT_NE(refusal("surf_vtk", "surf_read_nothing").find("surf_read_nothing"), std::string::npos);
}
#endif

}  // namespace
}  // namespace surf
