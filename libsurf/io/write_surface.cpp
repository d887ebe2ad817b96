#include "libsurf/io/write_surface.h"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/dicom_stl.h"
#include "libsurf/io/detail/gifti_file.h"
#include "libsurf/io/detail/glb_file.h"
#include "libsurf/io/detail/numbers.h"
#include "libsurf/io/detail/stl_file.h"
#include "libsurf/io/detail/threemf_file.h"
#include "libsurf/io/detail/vtp_file.h"

namespace surf::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL and PLY are little endian");

using Floats = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

template <class T>
void append(std::string& bytes, const T* values, std::size_t n) {
  bytes.append(reinterpret_cast<const char*>(values), n * sizeof(T));
}

// PLY is so simple that writing its bytes here is shorter than handing the surface to VTK, and a
// full disk is then noticed in one place for all formats.
std::string ply_bytes(const std::string&, const Triangles& surface, const WriteOptions& options) {
  const Eigen::Index n_arrays = Eigen::Index(options.arrays.size());
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(surface.points.rows(),
                                                                             3 + n_arrays);
  rows.leftCols(3) = surface.points.cast<float>();
  std::string properties;
  for (Eigen::Index k = 0; k < n_arrays; ++k) {
    rows.col(3 + k) = options.arrays[std::size_t(k)].values.cast<float>();
    properties += fmt::format("property float {}\n", options.arrays[std::size_t(k)].name);
  }
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment surfseg\ncomment SPACE={}\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      name(options.space), rows.rows(), properties, surface.elements.rows());
  append(bytes, rows.data(), rows.size());
  for (const auto element : surface.elements.rowwise()) {
    bytes += '\3';
    append(bytes, element.data(), 3);
  }
  return bytes;
}

/// A word for names in OBJ and MTL files, which end at a blank.
std::string word_of(std::string name) {
  for (char& c : name)
    if (static_cast<unsigned char>(c) <= ' ') c = '_';
  return name.empty() ? "surface" : name;
}

constexpr const char* kOwnMtl = "# surfseg\n";

std::string mtl_bytes(const WriteOptions& options) {
  const auto& colour = *options.colour;
  return fmt::format("{}newmtl {}\nKd {:.6g} {:.6g} {:.6g}\n", kOwnMtl, word_of(options.name),
                     colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
}

std::string obj_bytes(const std::string& path, const Triangles& surface,
                      const WriteOptions& options) {
  const Floats points = surface.points.cast<float>();
  std::string text = fmt::format("# surfseg\n# SPACE={}\n", name(options.space));
  if (options.colour)
    text +=
        fmt::format("mtllib {}\n", std::filesystem::path(file_beside(path)).filename().string());
  if (!options.name.empty()) text += fmt::format("o {}\n", word_of(options.name));
  for (const auto point : points.rowwise()) {
    text += 'v';
    for (int axis = 0; axis < 3; ++axis) {
      text += ' ';
      append_number(text, point[axis]);
    }
    text += '\n';
  }
  if (options.colour) text += fmt::format("usemtl {}\n", word_of(options.name));
  for (const auto element : surface.elements.rowwise())
    text += fmt::format("f {} {} {}\n", element[0] + 1, element[1] + 1, element[2] + 1);
  return text;
}

std::string vtp_bytes(const std::string&, const Triangles& surface, const WriteOptions& options) {
  return SURF_LATE(surf_vtk, surf_vtp_bytes)({surface, options.arrays}, options.space);
}

std::string gifti_bytes(const std::string&, const Triangles& surface, const WriteOptions& options) {
  return gifti_surface_bytes({converted(surface.points, options.space), surface.elements});
}

std::string dicom_bytes(const std::string& path, const Triangles& surface,
                        const WriteOptions& options) {
  return SURF_LATE(surf_dicom, surf_dicom_stl)(path, surface, options);
}

/// NAME.shape.gii of NAME.surf.gii or NAME.gii: programs that read surfaces want just the two
/// arrays of one in a file.
std::string shape_path(const std::string& stem) {
  const bool is_of_surf = extension(stem) == ".surf";
  return stem.substr(0, stem.size() - (is_of_surf ? std::strlen(".surf") : 0)) + ".shape.gii";
}

/// Without blanks: OBJ's mtllib would take such a name for several.
std::string mtl_path(const std::string& stem) {
  std::filesystem::path path(stem);
  return path.replace_filename(word_of(path.filename().string()) + ".mtl").string();
}

/// What stands in a file beside the surface; "" if nothing.
std::string shape_content(const WriteOptions& options) {
  return options.arrays.empty() ? "" : gifti_shape_bytes(options.arrays);
}
std::string mtl_content(const WriteOptions& options) {
  return options.colour ? mtl_bytes(options) : "";
}

struct Beside {
  std::string (*path)(const std::string& stem) = nullptr;
  std::string (*content)(const WriteOptions&) = nullptr;
  const char* own = "";  ///< what a file of ours has among its first bytes
};
constexpr Beside kShape = {shape_path, shape_content, "<Name>Generator</Name><Value>surfseg<"};
constexpr Beside kMtl = {mtl_path, mtl_content, kOwnMtl};

/// Those of formats that need no name of the file.
template <std::string (*kEncode)(const Triangles&, const WriteOptions&)>
std::string nameless(const std::string&, const Triangles& surface, const WriteOptions& options) {
  return kEncode(surface, options);
}

/// @param path  of the file, for messages and for names in it
using Encoder = std::string (*)(const std::string& path, const Triangles&, const WriteOptions&);
struct Format {
  std::string_view extension;
  std::string_view ending;  ///< of a name that is easy to know again
  Encoder encode;
  bool is_float32 = true;
  Beside beside = {};
};
constexpr Format kFormats[] = {{".stl", ".stl", nameless<stl_bytes>},
                               {".obj", ".obj", obj_bytes, true, kMtl},
                               {".ply", ".ply", ply_bytes},
                               {".vtp", ".vtp", vtp_bytes, false},
                               {".gii", ".surf.gii", gifti_bytes, true, kShape},
                               {".glb", ".glb", nameless<glb_bytes>},
                               {".3mf", ".3mf", nameless<threemf_bytes>},
                               {".dcm", ".stl.dcm", dicom_bytes}};

const Format* find_format(const std::string& ending) {
  for (const Format& format : kFormats)
    if (format.extension == ending) return &format;
  return nullptr;
}

const Format& format_of(const std::string& ending, const std::string& what) {
  if (const Format* format = find_format(ending)) return *format;
  throw UsageError(fmt::format("{}: '{}' is not a surface format that can be written; use {}", what,
                               ending, writable_surfaces()));
}

Triangles rounded(const Triangles& surface, const Format& format) {
  if (!format.is_float32) return surface;
  return {surface.points.cast<float>().cast<double>(), surface.elements};
}

void check(const Triangles& surface, const std::string& path) {
  if (!surface.points.allFinite())
    throw InvalidMesh(fmt::format("{}: not written: a coordinate is not finite", path));
  if (surface.elements.size() > 0 &&
      (surface.elements.minCoeff() < 0 || surface.elements.maxCoeff() >= surface.points.rows()))
    throw InvalidMesh(fmt::format("{}: not written: a triangle names a missing point", path));
}

void remove_if_own(const std::string& path, const Beside& beside) {
  constexpr std::size_t kEnough = 1024;
  std::string begin(kEnough, '\0');
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return;
  stream.read(begin.data(), std::streamsize(begin.size()));
  if (begin.find(beside.own) == std::string::npos) return;  // somebody else's
  std::error_code status;
  std::filesystem::remove(path, status);
}

}  // namespace

bool is_writable_surface(const std::string& path) {
  return find_format(extension(path)) != nullptr;
}

std::vector<std::string> surface_endings() {
  std::vector<std::string> out;
  for (const Format& format : kFormats) out.emplace_back(format.ending);
  return out;
}

std::string file_beside(const std::string& path) {
  const Format* format = find_format(extension(path));
  if (!format || !format->beside.path) return {};
  return format->beside.path(path.substr(0, path.size() - format->extension.size()));
}

std::string writable_surfaces() {
  std::string out;
  for (const Format& format : kFormats) {
    if (!out.empty()) out += &format == std::end(kFormats) - 1 ? " or " : ", ";
    out += format.extension;
  }
  return out;
}

Triangles rounded_to_file(const Triangles& surface, const std::string& ending) {
  return rounded(surface, format_of(ending, "surface file"));
}

void write_surface(const std::string& path, const Triangles& surface, const WriteOptions& options) {
  const Format& format = format_of(extension(path), path);
  Triangles in_file = rounded(surface, format);
  check(in_file, path);
  for (const PointArray& array : options.arrays)
    if (array.values.size() != in_file.points.rows())
      throw InvalidMesh(fmt::format("{}: not written: array {} has {} values for {} points", path,
                                    array.name, array.values.size(), in_file.points.rows()));
  in_file.points = converted(in_file.points, options.space);
  write_bytes(path, format.encode(path, in_file, options));
  const std::string beside = file_beside(path);
  if (beside.empty()) return;
  const std::string content = format.beside.content(options);
  content.empty() ? remove_if_own(beside, format.beside) : write_bytes(beside, content);
}

}  // namespace surf::io
