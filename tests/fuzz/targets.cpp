#include "tests/fuzz/targets.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "libcurve/image/read_image.h"
#include "libcurve/io/contour_file.h"
#include "libsurf/base/error.h"
#include "libsurf/io/read_landmarks.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/segment/detail/recipe_json.h"
#include "libsurf/volume/read_volume.h"
#include "tests/fuzz/allocations.h"
#include "tools/common/config.h"

namespace surf::fuzz {
namespace {

namespace fs = std::filesystem;

void read_volume(const std::string& path) { volume::read_volume(path, {}); }

/// A slice is no volume: beside it lies the next one of its series.
void read_slices(const std::string& path) {
  const fs::path other = fs::path(path).parent_path() / "next.dcm";
  fs::copy_file(SURFSEG_FUZZ_FOLDER "/next-slice.dcm", other, fs::copy_options::skip_existing);
  volume::read_volume(path, {});
}

void read_surface(const std::string& path) { io::read_surface(path); }
void read_image(const std::string& path) { curve::read_image(path); }
void read_contours(const std::string& path) { curve::read_contours(path); }
void read_landmarks(const std::string& path) { io::read_landmarks(path); }

void read_recipe(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const auto recipe = segment::parse_recipe(text);
  if (recipe.value("dimension", nlohmann::ordered_json()) == 2)
    segment::recipe_content<2>(recipe);
  else
    segment::recipe_content<3>(recipe);
}

/// A command with an option of each kind.
void read_config(const std::string& path) {
  CLI::App command{"", "segment"};
  std::vector<std::string> seeds;
  std::string output, flow;
  double gamma = 0;
  int levels = 1;
  bool is_quiet = false;
  command.add_option("--seed", seeds)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_option("-o,--output", output);
  command.add_option("--flow", flow)->check(CLI::IsMember({"h1", "l2"}));
  command.add_option("--gamma", gamma);
  command.add_option("--levels", levels);
  command.add_flag("-q,--quiet", is_quiet);
  surfseg::apply_config(command, path);
}

// Of a byte: deflate makes at most 1032 of one, each a voxel that is held as a float; text makes no
// more numbers than it has characters, but nodes of a document are large.
constexpr double kInflated = 4.0 * 4 * 1032, kText = 4.0 * 100;
/// A pixel of one bit is a colour of four bytes first, then a float.
constexpr double kInflatedBits = 9.0 * 8 * 1032;

constexpr Target kTargets[] = {
    {"nifti", "a.nii", read_volume, kInflated},
    {"metaimage", "a.mha", read_volume, kInflated},
    {"nrrd", "a.nrrd", read_volume, kInflated},
    {"dicom", "a.dcm", read_slices, kInflated},
    {"vti", "a.vti", read_volume, kInflated},
    {"vdb", "a.vdb", read_volume, kInflated},
    {"stl", "a.stl", read_surface, kText},
    {"obj", "a.obj", read_surface, kText},
    {"ply", "a.ply", read_surface, kText},
    {"vtp", "a.vtp", read_surface, kInflated},
    {"png", "a.png", read_image, kInflated},
    {"jpeg", "a.jpg", read_image, kInflated},
    {"tiff", "a.tif", read_image, kInflatedBits},
    {"geojson", "a.json", read_contours, kText},
    {"contours-csv", "a.csv", read_contours, kText},
    {"landmarks-fcsv", "a.fcsv", read_landmarks, kText},
    {"landmarks-json", "a.mrk.json", read_landmarks, kText},
    {"landmarks-text", "a.txt", read_landmarks, kText},
    {"recipe", "a.json", read_recipe, kText},
    {"config", "a.json", read_config, kText},
};

/// Removed with what is in it when the process ends.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / fmt::format("surfseg-fuzz-{}", ::getpid())) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code status;
    fs::remove_all(path_, status);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string written(const Target& target, std::span<const std::uint8_t> bytes) {
  static const Folder folder;
  const fs::path own = folder.path() / target.name;
  fs::create_directories(own);
  const std::string path = (own / target.file).string();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  return path;
}

}  // namespace

std::span<const Target> targets() { return kTargets; }

const Target& target(const std::string& name) {
  for (const Target& one : kTargets)
    if (name == one.name) return one;
  throw std::invalid_argument("no target " + name);
}

Reading run(const Target& target, std::span<const std::uint8_t> bytes) {
  const std::string path = written(target, bytes);
  Reading out;
  const AllocationMeter meter;
  try {
    target.read(path);
    out.is_read = true;
  } catch (const Error& error) {
    out.message = error.what();
  }
  out.peak_bytes = meter.peak();
  if (out.message.find('\n') != std::string::npos)
    throw std::logic_error(fmt::format("a message of several lines: {}", out.message));
  if (double(out.peak_bytes) > double(kFreeBytes) + target.most_per_byte * double(bytes.size()))
    throw std::logic_error(fmt::format("{} bytes of memory for a file of {} bytes: {}",
                                       out.peak_bytes, bytes.size(), out.message));
  return out;
}

}  // namespace surf::fuzz
