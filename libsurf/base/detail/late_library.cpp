#include "libsurf/base/detail/late_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>

#include "libsurf/base/error.h"

namespace surf {
namespace {

namespace fs = std::filesystem;

/// Where this code is.
fs::path own_folder() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<const void*>(&late_symbol), &info) == 0 || !info.dli_fname)
    return {};
  std::error_code status;
  return fs::absolute(info.dli_fname, status).parent_path();
}

/// Not one that the system may have elsewhere, which could be of another build.
void* load(const std::string& file) {
  if (void* handle = ::dlopen((own_folder() / file).c_str(), RTLD_NOW | RTLD_LOCAL)) return handle;
  throw Error(
      fmt::format("a library of surfseg cannot be loaded: {}; install surfseg again", ::dlerror()));
}

}  // namespace

const void* late_symbol(const std::string& library, const std::string& symbol) {
  const std::string file = fmt::format("lib{}.so.{}", library, SURFSEG_VERSION);
  if (const void* address = ::dlsym(load(file), symbol.c_str())) return address;
  throw Error(
      fmt::format("{} has no {}: it is of another surfseg; install surfseg again", file, symbol));
}

}  // namespace surf
