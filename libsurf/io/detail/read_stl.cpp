#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "libsurf/io/detail/surface_formats.h"

namespace surf::io {
namespace {

constexpr std::size_t kHeader = 80, kFirstFacet = 84, kFacet = 50;

/// Joins vertices whose coordinates are equal.
class Weld {
 public:
  explicit Weld(FileSurface& surface) : surface_(surface) {}

  std::int64_t index_of(std::array<double, 3> point) {
    for (double& x : point) x += 0.0;  // -0 becomes 0
    if (std::any_of(point.begin(), point.end(), [](double x) { return std::isnan(x); })) {
      surface_.points.push_back(point);  // is none like it; the reader refuses it
      return static_cast<std::int64_t>(surface_.points.size()) - 1;
    }
    const auto [at, is_new] =
        indices_.try_emplace(point, static_cast<std::int64_t>(surface_.points.size()));
    if (is_new) surface_.points.push_back(point);
    return at->second;
  }

 private:
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& point) const {
      std::uint64_t hash = 0;
      for (const double x : point) {
        hash ^= std::bit_cast<std::uint64_t>(x) + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
        hash *= 0xff51afd7ed558ccdu;
      }
      return hash ^ (hash >> 32);
    }
  };
  FileSurface& surface_;
  std::unordered_map<std::array<double, 3>, std::int64_t, Hash> indices_;
};

std::uint32_t n_facets(const std::string& content) {
  std::uint32_t n = 0;
  std::memcpy(&n, content.data() + kHeader, sizeof n);
  return n;
}

/// Binary files may begin with "solid" too; their length tells.
bool is_ascii(const std::string& content) {
  if (!content.starts_with("solid")) return false;
  return content.size() < kFirstFacet ||
         content.size() != kFirstFacet + kFacet * std::size_t(n_facets(content));
}

FileSurface read_binary(const std::string& path, const std::string& content) {
  if (content.size() < kFirstFacet)
    throw InputError(fmt::format("{}: {} bytes are too few for an STL file", path, content.size()));
  const std::size_t n = n_facets(content);
  if (content.size() < kFirstFacet + kFacet * n)
    throw InputError(fmt::format("{}: truncated: {} triangles need {} bytes, the file has {}", path,
                                 n, kFirstFacet + kFacet * n, content.size()));
  FileSurface surface;
  surface.space = stated_space(std::string_view(content).substr(0, kHeader), path);
  surface.elements.reserve(n);
  Weld weld(surface);
  for (std::size_t facet = 0; facet < n; ++facet) {
    float x[9];
    std::memcpy(x, content.data() + kFirstFacet + kFacet * facet + 12, sizeof x);
    std::array<std::int64_t, 3> element;
    for (int i = 0; i < 3; ++i) element[i] = weld.index_of({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    surface.elements.push_back(element);
  }
  return surface;
}

FileSurface read_ascii(const std::string& path, const std::string& content) {
  FileSurface surface;
  Weld weld(surface);
  Lines lines(content);
  std::vector<std::int64_t> facet;
  bool is_complete = false;
  while (lines.next()) {
    const std::string_view keyword = lines.word();
    if (keyword == "solid" && !surface.space) surface.space = stated_space(lines.line(), path);
    if (keyword == "vertex") facet.push_back(weld.index_of(read_point(path, lines)));
    if (keyword == "endfacet") {
      if (facet.size() != 3)
        throw InputError(fmt::format("{}:{}: a facet with {} vertices; expected 3", path,
                                     lines.number(), facet.size()));
      surface.add_polygon(facet);
      surface.lines.push_back(lines.number());
      facet.clear();
    }
    is_complete = keyword == "endsolid" || (is_complete && keyword.empty());
  }
  if (!is_complete)
    throw InputError(fmt::format("{}:{}: truncated: no endsolid", path, lines.number()));
  return surface;
}

}  // namespace

FileSurface read_stl(const std::string& path, const std::string& content) {
  return is_ascii(content) ? read_ascii(path, content) : read_binary(path, content);
}

}  // namespace surf::io
