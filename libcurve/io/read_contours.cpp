#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "libcurve/io/contour_file.h"
#include "libsurf/base/affine.h"
#include "libsurf/base/arrays.h"
#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/base/file.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

using Eigen::Vector2d;

using Ring = std::vector<Vector2d>;

/// Rings of polygons as they are read, by polygon and number.
using RingMap = std::map<std::array<int, 2>, Ring>;

/// Twice the signed area of a ring.
double twice_area(const Ring& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d a = ring[i] - ring[0], b = ring[(i + 1) % ring.size()] - ring[0];
    sum += cross(a, b);
  }
  return sum;
}

Segments to_segments(const std::string& path, RingMap& rings) {
  std::vector<Vector2d> points;
  std::vector<std::array<int, 2>> elements;
  for (auto& [key, ring] : rings) {
    if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    if (ring.size() < 3)
      throw InputError(fmt::format("{}: ring {} of polygon {} has {} points; expected 3 or more",
                                   path, key[1], key[0], ring.size()));
    if ((twice_area(ring) > 0) != (key[1] == 0)) std::reverse(ring.begin(), ring.end());
    const int first = int(points.size()), n = int(ring.size());
    points.insert(points.end(), ring.begin(), ring.end());
    for (int i = 0; i < n; ++i) elements.push_back({first + i, first + (i + 1) % n});
  }
  if (rings.empty()) throw InputError(fmt::format("{}: holds no polygon", path));
  Segments out{points_of<2>(points), elements_of(elements)};
  if (!out.points.allFinite())
    throw InputError(fmt::format("{}: a coordinate is not finite", path));
  return out;
}

void add_polygon(const nlohmann::json& coordinates, int polygon, RingMap& rings) {
  for (std::size_t r = 0; r < coordinates.size(); ++r) {
    Ring& ring = rings[{polygon, int(r)}];
    for (const auto& point : coordinates.at(r)) {
      if (point.size() != 2) throw InputError("points of two coordinates are expected");
      ring.emplace_back(point.at(0).get<double>(), point.at(1).get<double>());
    }
  }
}

/// @param depth  of collections and features round it
void add_geometry(const nlohmann::json& object, RingMap& rings, int depth = 0) {
  constexpr int kDeepest = 8;
  if (depth > kDeepest) throw InputError("features within features");
  const std::string type = object.at("type");
  const auto next = [&] { return rings.empty() ? 0 : rings.rbegin()->first[0] + 1; };
  if (type == "FeatureCollection")
    for (const auto& feature : object.at("features")) add_geometry(feature, rings, depth + 1);
  else if (type == "Feature")
    add_geometry(object.at("geometry"), rings, depth + 1);
  else if (type == "Polygon")
    add_polygon(object.at("coordinates"), next(), rings);
  else if (type == "MultiPolygon")
    for (const auto& polygon : object.at("coordinates")) add_polygon(polygon, next(), rings);
  else
    throw InputError(fmt::format("a Polygon is expected, not '{}'", one_line(type)));
}

RingMap rings_of_json(const std::string& path, std::istream& stream) {
  RingMap rings;
  try {
    add_geometry(nlohmann::json::parse(stream), rings);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: not GeoJSON: {}", path, error.what()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: not a contour file: {}", path, error.what()));
  }
  return rings;
}

RingMap rings_of_csv(const std::string& path, std::istream& stream) {
  RingMap rings;
  std::string line;
  std::getline(stream, line);
  if (!line.starts_with("polygon,ring,x_mm,y_mm"))
    throw InputError(
        fmt::format("{}:1: expected the columns polygon,ring,x_mm,y_mm; got '{}'", path, line));
  for (int n = 2; std::getline(stream, line); ++n) {
    std::array<double, 4> values{};
    const char* at = line.data();
    const char* const end = at + line.size();
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto [next, status] = std::from_chars(at, end, values[i]);
      const bool is_at_end = next == end || (*next == '\r' && next + 1 == end);
      if (status != std::errc() || (i < 3 ? next == end || *next != ',' : !is_at_end))
        throw InputError(fmt::format("{}:{}: expected four numbers; got '{}'", path, n, line));
      at = next + 1;
    }
    constexpr double kMost = std::numeric_limits<int>::max();
    for (const double number : {values[0], values[1]})
      if (!(number >= 0 && number <= kMost && number == std::floor(number)))
        throw InputError(
            fmt::format("{}:{}: polygon and ring are counted from 0; got '{}'", path, n, line));
    rings[{int(values[0]), int(values[1])}].emplace_back(values[2], values[3]);
  }
  return rings;
}

std::ifstream opened(const std::string& path) {
  std::ifstream out(path);
  if (!out) throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  return out;
}

/// The matrix of the upper rows that are written.
template <int Dim>
Eigen::Transform<double, Dim, Eigen::Affine> affine_of(const nlohmann::json& rows,
                                                       const std::string& path, const char* cell) {
  const auto values = rows.get<std::array<std::array<double, Dim + 1>, Dim>>();
  Eigen::Transform<double, Dim, Eigen::Affine> out;
  out.setIdentity();
  for (int i = 0; i < Dim; ++i)
    for (int j = 0; j <= Dim; ++j) out.matrix()(i, j) = values[i][j];
  return checked_affine<Dim>(out.matrix(), path, cell);
}

}  // namespace

bool is_readable_contour(const std::string& path) {
  return extension(path) == ".json" || extension(path) == ".csv";
}

Segments read_contours(const std::string& path) {
  if (!is_readable_contour(path))
    throw InputError(fmt::format("{}: contours are read from .json and .csv files", path));
  std::ifstream stream = opened(path);
  RingMap rings =
      extension(path) == ".json" ? rings_of_json(path, stream) : rings_of_csv(path, stream);
  return to_segments(path, rings);
}

std::optional<ContourPixels> pixels_of_contours(const std::string& path) {
  if (extension(path) != ".json") return std::nullopt;
  std::ifstream stream = opened(path);
  const auto file = nlohmann::json::parse(stream, nullptr, false);
  ContourPixels out;
  try {
    out.size = file.at("size").get<std::array<int, 2>>();
    out.to_plane = affine_of<2>(file.at("pixel_to_mm"), path, "pixel");
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
  if (!file.contains("mm_to_ras")) return out;
  // Without it the curves would be compared with those of another place in silence.
  try {
    out.plane_to_ras = affine_of<3>(file["mm_to_ras"], path, "mm");
    out.thickness_mm = file.value("thickness_mm", 0.0);
  } catch (const nlohmann::json::exception&) {
    throw InputError(
        path + ": expected mm_to_ras as three rows of four numbers, thickness_mm as a number");
  }
  return out;
}

}  // namespace surf::curve
