#include "libsurf/mesh/detail/rims.h"

#include <algorithm>
#include <map>

namespace surf::mesh {

std::vector<Side> free_sides(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (const auto& triangle : triangles)
    for (int i = 0; i < 3; ++i) sides.emplace_back(triangle[i], triangle[(i + 1) % 3]);
  std::sort(sides.begin(), sides.end());
  std::vector<Side> out;
  for (const Side& side : sides)
    if (!std::binary_search(sides.begin(), sides.end(), Side(side.second, side.first)))
      out.push_back(side);
  return out;
}

std::vector<Side> free_sides(const ConnectedSurface& surface, const TriangleFlags& is_chosen) {
  std::vector<Side> out;
  for (int t = 0; t < surface.n_triangles(); ++t)
    for (int i = 0; is_chosen[t] && i < 3; ++i)
      if (!is_chosen[surface.across(t, i)])
        out.emplace_back(surface.vertex(t, i), surface.vertex(t, (i + 1) % 3));
  return out;
}

std::vector<int> crowded_vertices(const std::vector<Side>& sides) {
  std::vector<int> out;
  for (std::size_t i = 1; i < sides.size(); ++i)
    if (const int from = sides[i].first;
        sides[i - 1].first == from && (out.empty() || out.back() != from))
      out.push_back(from);
  return out;
}

std::optional<std::vector<Rim>> rims(const std::vector<Side>& sides) {
  std::map<int, int> next;
  for (const auto& [from, to] : sides)
    if (!next.emplace(from, to).second) return std::nullopt;
  std::vector<Rim> out;
  while (!next.empty()) {
    Rim rim;
    for (auto at = next.begin(); at != next.end(); at = next.find(rim.back())) {
      if (rim.empty()) rim.push_back(at->first);
      rim.push_back(at->second);
      next.erase(at);
    }
    if (rim.front() != rim.back()) return std::nullopt;
    rim.pop_back();
    out.push_back(std::move(rim));
  }
  return out;
}

}  // namespace surf::mesh
