#include "tools/batch/fingerprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <vector>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/file.h"
#include "libsurf/segment/presets.h"
#include "tools/batch/clicks_cell.h"

namespace surfseg::batch {
namespace {

namespace fs = std::filesystem;

/// Formats of volumes that are one file each; a scan of another may be one of a DICOM series.
constexpr std::array kWhole = {".nii", ".nii.gz", ".gz", ".mha", ".nrrd", ".vti", ".vdb"};
constexpr std::array kHeaders = {".hdr", ".img", ".mhd", ".nhdr"};

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code status;
  for (const auto& entry : fs::directory_iterator(folder, status))
    if (entry.is_regular_file(status)) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

/// Everything that may be read when this file is.
std::vector<fs::path> files_of(const fs::path& path, bool is_scan) {
  const auto is_one_of = [ending = surf::extension(path.string())](const auto& endings) {
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
  };
  std::error_code status;
  if (fs::is_directory(path, status)) return files_in(path);
  if (!fs::exists(path, status)) return {};
  const bool is_header = is_one_of(kHeaders);
  if (!is_header && (!is_scan || is_one_of(kWhole))) return {path};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::vector<fs::path> out = files_in(folder);
  if (is_header)
    std::erase_if(out, [&](const fs::path& other) { return other.stem() != path.stem(); });
  return out;
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
    for (const fs::path& path : files_of(named, named == row.scan)) add_file(path, hash);
  }
  if (const auto preset = row.settings.find("preset"); preset != row.settings.end())
    add_file(surf::segment::find_preset(preset->second).path, hash);
  return hash.digits();
}

}  // namespace surfseg::batch
