#include <array>
#include <cstdio>
#include <memory>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

/// What the loader brings with the program before main().
std::string loaded_libraries() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(
      ::popen("LD_TRACE_LOADED_OBJECTS=1 " SURFSEG_PROGRAM, "r"), ::pclose);
  std::string out;
  std::array<char, 4096> some;
  while (pipe && std::fgets(some.data(), some.size(), pipe.get())) out += some.data();
  return out;
}

TEST(LateLibraries, AreNotLoadedWithTheProgram) {
  const std::string loaded = loaded_libraries();
  if (loaded.find("libsurf.so") == std::string::npos) GTEST_SKIP() << "surf is linked statically";
  for (const char* library :
       {"libvtkIO", "libvtkRendering", "libvtkCommon", "libgdcm", "libdcm", "libX11", "libopenvdb"})
    EXPECT_EQ(loaded.find(library), std::string::npos) << loaded;
}

}  // namespace
}  // namespace surfseg::test
