#include "tools/batch/fingerprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/presets.h"
#include "libsurf/volume/read_volume.h"
#include "tools/batch/clicks_cell.h"

namespace surfseg::batch {
namespace {

namespace fs = std::filesystem;

/// Of a volume whose voxels may be elsewhere.
bool is_header(const std::string& path) {
  constexpr std::array kHeaders = {".hdr", ".img", ".hdr.gz", ".img.gz",
                                   ".mhd", ".mha", ".nhdr",   ".nrrd"};
  const std::string name = surf::extension(fs::path(path).stem().string());
  std::string ending = surf::extension(path);
  if (ending == ".gz") ending = name + ending;
  return std::find(kHeaders.begin(), kHeaders.end(), ending) != kHeaders.end();
}

/// Everything that may be read when this file is.
std::vector<std::string> files_of(const std::string& path, bool is_scan) {
  std::error_code status;
  if (!fs::exists(path, status)) return {};
  // A label map may have its voxels in another file; a scan may be one of a series, too.
  if (!is_scan && !is_header(path)) return {path};
  try {
    return surf::volume::volume_files(path);
  } catch (const surf::InputError&) {
    return {path};  // no volume, or one that cannot be read: then it is not done already
  }
}

void add_file(const fs::path& path, surf::ContentHash& hash) {
  std::ifstream stream(path, std::ios::binary);
  hash.add_bytes(fmt::format("\nfile {}\n", path.filename().string()));
  std::vector<char> block(std::size_t(1) << 20);
  while (stream) {
    stream.read(block.data(), std::streamsize(block.size()));
    hash.add_bytes({block.data(), std::size_t(stream.gcount())});
  }
}

}  // namespace

std::string fingerprint(const Case& row) {
  surf::ContentHash hash;
  hash.add_bytes("surfseg " SURFSEG_VERSION);
  for (const auto& [column, text] : row.settings)
    hash.add_bytes(fmt::format("\n{}\t{}", column, text));
  for (const std::string& named : row.files) {
    hash.add_bytes("\nnext");
    for (const std::string& path : files_of(named, named == row.scan)) add_file(path, hash);
  }
  if (const auto preset = row.settings.find("preset"); preset != row.settings.end())
    add_file(surf::segment::find_preset(preset->second).path, hash);
  return hash.digits();
}

}  // namespace surfseg::batch
