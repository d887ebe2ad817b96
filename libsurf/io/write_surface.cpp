#include "libsurf/io/write_surface.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <Eigen/Geometry>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/gifti_file.h"
#include "libsurf/io/detail/glb_file.h"
#include "libsurf/io/detail/vtp_file.h"

namespace surf::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL and PLY are little endian");

using Floats = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

template <class T>
void append(std::string& bytes, const T* values, std::size_t n) {
  bytes.append(reinterpret_cast<const char*>(values), n * sizeof(T));
}

// STL and PLY are so simple that writing their bytes here is shorter than handing the surface
// to VTK, and a full disk is then noticed in one place for all formats.
std::string stl_bytes(const Triangles& surface, const WriteOptions& options) {
  const Floats points = surface.points.cast<float>();
  std::string header = fmt::format("surfseg SPACE={} UNIT=mm", name(options.space));
  header.resize(80, ' ');
  std::string bytes;
  bytes.reserve(84 + 50 * surface.elements.rows());
  bytes += header;
  const auto n = static_cast<std::uint32_t>(surface.elements.rows());
  append(bytes, &n, 1);
  for (const auto element : surface.elements.rowwise()) {
    const Eigen::Vector3f a = points.row(element[0]), b = points.row(element[1]),
                          c = points.row(element[2]);
    // In double, so that the cross product of short edges does not underflow.
    const Eigen::Vector3d area = (b - a).cast<double>().cross((c - a).cast<double>());
    const Eigen::Vector3f normal = area.stableNormalized().cast<float>();
    for (const Eigen::Vector3f& vector : {normal, a, b, c}) append(bytes, vector.data(), 3);
    const std::uint16_t attribute = 0;
    append(bytes, &attribute, 1);
  }
  return bytes;
}

std::string ply_bytes(const Triangles& surface, const WriteOptions& options) {
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

/// All digits of the float: whether a reader keeps floats or doubles, it gets the same number.
void append_number(std::string& text, double value) {
  char digits[32];
  const auto [end, status] = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, end);
}

std::string obj_bytes(const Triangles& surface, const WriteOptions& options) {
  const Floats points = surface.points.cast<float>();
  std::string text = fmt::format("# surfseg\n# SPACE={}\n", name(options.space));
  for (const auto point : points.rowwise()) {
    text += 'v';
    for (int axis = 0; axis < 3; ++axis) {
      text += ' ';
      append_number(text, point[axis]);
    }
    text += '\n';
  }
  for (const auto element : surface.elements.rowwise())
    text += fmt::format("f {} {} {}\n", element[0] + 1, element[1] + 1, element[2] + 1);
  return text;
}

std::string vtp_bytes(const Triangles& surface, const WriteOptions& options) {
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(surface.elements.rows(), surface.elements.size());
  for (const auto element : surface.elements.rowwise())
    cells->InsertNextCell({element[0], element[1], element[2]});
  vtkNew<vtkPolyData> data;
  data->SetPoints(to_vtk(surface.points));
  data->SetPolys(cells);
  for (const PointArray& array : options.arrays) {
    vtkNew<vtkDoubleArray> values;
    values->SetName(array.name.c_str());
    for (const double value : array.values) values->InsertNextValue(value);
    data->GetPointData()->AddArray(values);
  }
  return vtp_file(*data, options.space);
}

std::string gifti_bytes(const Triangles& surface, const WriteOptions& options) {
  return gifti_surface_bytes({converted(surface.points, options.space), surface.elements});
}

/// NAME.shape.gii of NAME.surf.gii or NAME.gii: programs that read surfaces want just the two
/// arrays of one in a file.
std::string shape_path(const std::string& path) {
  std::string stem = path.substr(0, path.size() - std::strlen(".gii"));
  if (extension(stem) == ".surf") stem.resize(stem.size() - std::strlen(".surf"));
  return stem + ".shape.gii";
}

using Encoder = std::string (*)(const Triangles&, const WriteOptions&);
struct Format {
  std::string_view extension;
  Encoder encode;
  bool is_float32;
};
constexpr Format kFormats[] = {{".stl", stl_bytes, true},   {".obj", obj_bytes, true},
                               {".ply", ply_bytes, true},   {".vtp", vtp_bytes, false},
                               {".gii", gifti_bytes, true}, {".glb", glb_bytes, true}};

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

}  // namespace

bool is_writable_surface(const std::string& path) {
  return find_format(extension(path)) != nullptr;
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
  write_bytes(path, format.encode(in_file, options));
  if (format.extension == ".gii" && !options.arrays.empty())
    write_bytes(shape_path(path), gifti_shape_bytes(options.arrays));
}

}  // namespace surf::io
