#include "libsurf/io/detail/stl_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <bit>
#include <cstdint>

namespace surf::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is little endian");

template <class T>
void append(std::string& bytes, const T* values, std::size_t n) {
  bytes.append(reinterpret_cast<const char*>(values), n * sizeof(T));
}

}  // namespace

// So simple that writing the bytes here is shorter than handing the surface to VTK.
std::string stl_bytes(const Triangles& surface, const WriteOptions& options) {
  const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> points =
      surface.points.cast<float>();
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

}  // namespace surf::io
