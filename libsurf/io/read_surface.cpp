#include "libsurf/io/read_surface.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/surface_formats.h"
#include "libsurf/io/detail/vtp_file.h"

namespace surf::io {
namespace {

constexpr double kLargest = 1e150;  // of a coordinate: its square and those of a sum are finite

using Reader = FileSurface (*)(const std::string&, const std::string&);

FileSurface read_vtp(const std::string& path, const std::string& content) {
  return SURF_LATE(surf_vtk, surf_read_vtp)(path, content);
}

Reader find_reader(const std::string& ending) {
  constexpr std::pair<std::string_view, Reader> kReaders[] = {
      {".stl", read_stl}, {".obj", read_obj}, {".ply", read_ply}, {".vtp", read_vtp}};
  for (const auto& [name, reader] : kReaders)
    if (name == ending) return reader;
  return nullptr;
}

std::string content_of(const std::string& path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status))
    throw InputError(fmt::format("{}: is a folder; give a surface file", path));
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (!stream) throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  std::string content(static_cast<std::size_t>(std::max<std::streamoff>(stream.tellg(), 0)), '\0');
  stream.seekg(0);
  if (!stream.read(content.data(), static_cast<std::streamsize>(content.size())))
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  if (content.empty()) throw InputError(fmt::format("{}: the file is empty", path));
  return content;
}

void check(const std::string& path, const FileSurface& surface) {
  if (surface.elements.empty()) throw InputError(fmt::format("{}: holds no faces", path));
  if (surface.points.size() > std::size_t(std::numeric_limits<int>::max()) ||
      surface.elements.size() > std::size_t(std::numeric_limits<int>::max()))
    throw InputError(fmt::format("{}: more than 2^31 points or triangles", path));
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    for (const double x : surface.points[i])
      if (!(std::abs(x) <= kLargest))
        throw InputError(fmt::format("{}: vertex {} has the coordinate {}", path, i + 1, x));
  const auto n = static_cast<std::int64_t>(surface.points.size());
  for (std::size_t i = 0; i < surface.elements.size(); ++i)
    for (const std::int64_t vertex : surface.elements[i])
      if (vertex < 0 || vertex >= n) {
        const std::string place = surface.lines.empty()
                                      ? fmt::format("{}: triangle {}", path, i + 1)
                                      : fmt::format("{}:{}: face", path, surface.lines[i]);
        throw InputError(fmt::format("{} names vertex {} (from 0), but the file has {} vertices",
                                     place, vertex, n));
      }
}

FileSurface file_surface(const std::string& path) {
  const Reader read = find_reader(extension(path));
  if (read == nullptr)
    throw InputError(fmt::format(
        "{}: not a surface file by its ending; expected .stl, .obj, .ply or .vtp", path));
  FileSurface surface = read(path, content_of(path));
  check(path, surface);
  return surface;
}

}  // namespace

std::array<double, 3> read_point(const std::string& path, Lines& lines) {
  std::array<double, 3> point;
  for (double& x : point) {
    const std::string_view word = lines.word();
    const auto value = to_number<double>(word);
    if (!value)
      throw InputError(
          fmt::format("{}:{}: expected three coordinates; got '{}'", path, lines.number(), word));
    x = *value;
  }
  return point;
}

bool is_readable_surface(const std::string& path) {
  return find_reader(extension(path)) != nullptr;
}

Triangles read_surface(const std::string& path, const ReadOptions& options) {
  const FileSurface surface = file_surface(path);
  Triangles result;
  result.points.resize(static_cast<Eigen::Index>(surface.points.size()), 3);
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    result.points.row(static_cast<Eigen::Index>(i)) =
        Eigen::RowVector3d::Map(surface.points[i].data());
  result.points = converted(result.points, surface.space.value_or(options.unstated_space));
  result.elements.resize(static_cast<Eigen::Index>(surface.elements.size()), 3);
  for (std::size_t i = 0; i < surface.elements.size(); ++i)
    for (int k = 0; k < 3; ++k)
      result.elements(static_cast<Eigen::Index>(i), k) = static_cast<int>(surface.elements[i][k]);
  return result;
}

Eigen::VectorXd read_point_array(const std::string& path, const std::string& name) {
  const FileSurface surface = file_surface(path);
  const auto found = surface.arrays.find(name);
  if (found == surface.arrays.end()) {
    std::string others;
    for (const auto& [other, values] : surface.arrays)
      others += (others.empty() ? "; it has " : ", ") + other;
    throw InputError(fmt::format("{}: its points have no numbers by the name '{}'{}", path, name,
                                 others.empty() ? "; it has none" : others));
  }
  if (found->second.size() != surface.points.size())
    throw InputError(fmt::format("{}: {} values of '{}' for {} points", path, found->second.size(),
                                 name, surface.points.size()));
  return Eigen::Map<const Eigen::VectorXd>(found->second.data(),
                                           Eigen::Index(found->second.size()));
}

}  // namespace surf::io
